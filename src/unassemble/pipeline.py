"""The whole recovery on one page: check, recognise, solve, place, certify."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import certify as certificates
from .cells import exchanges
from .clock import Clock
from .errors import InputError, RecoveryError
from .evidence import pooled_noise, weigh
from .joined import JoinedMesh
from .linalg import AnalysisAhead, factorisation
from .linalg import threads as thread_limit
from .matrix import OperatorMatrix, check_matrix, read_matrix
from .operators import OPERATORS, VectorReading, asked_for, refuse, second_reading, vector_valued
from .placement import Direction, Placement
from .planar.deviations import coordinate_covariances
from .planar.hinges import join
from .planar.pencil import pencil_pattern
from .planar.piece import PieceMesh
from .recovery import Recovery
from .solving import solve
from .topology import Polygons, Topology, local_numbering, surfaces, triangles_everywhere
from .verdict import ambiguous, passes, verdict


def recover(
    A: Any,
    *,
    operator: str = "auto",
    method: str | None = None,
    refine: bool = True,
    scale: float | None = None,
    noise: float | None = None,
    drop_zeros: float | None = None,
    anchors: Sequence[Any] | None = None,
    tensor: tuple[float, float, float] | None = None,
    direction: Direction | None = None,
    handed: str | None = None,
    standard_deviations: bool = False,
    triangulate: bool = False,
    block_size: int | None = None,
    numbering: Any = None,
    cells: bool = True,
    variable: str | None = None,
    threads: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Recovery:
    """Recover the mesh that a matrix was assembled on.

    Scalar: A = c L + D, where L is the stiffness matrix of the Laplacian with linear elements on triangles in the
    plane and natural boundary conditions, c any nonzero number and D any diagonal matrix, both unknown.
    Vector-valued: isotropic linear elasticity in the plane or in space, with supports; see
    :func:`unassemble.elasticity.recover_elasticity`.

    Parameters
    ----------
    A : sparse matrix or array, ndarray, path, or "-"
        A matrix; or a file with one: Matrix Market, scipy's ``.npz``, ``.mat``; ``"-"`` reads Matrix Market from
        standard input. Explicit zeros are structure.
    operator : {"auto", "laplacian", "elasticity"}
        Which operator A belongs to. ``"auto"`` reads planar meshes as scalar, and matrices whose graph is none but
        whose rows form nodes of two or three unknowns as elasticity.
    method : {None, "conformal", "angles"}
        How positions are found: by the conformal null vector, the default, or by the 2002 paper's equations for angles.
    refine : bool
        Polish the positions by Gauss-Newton to the level that the entries allow.
    scale : float, optional
        c, where it is known.
    noise : float, optional
        Standard deviation of independent Gaussian errors in the entries of the upper triangle; the certificate
        becomes a chi-square test. Where both triangles carry errors of their own their mean is fitted, and its
        error is smaller by a factor sqrt(2).
    drop_zeros : float, optional
        Forget stored entries of at most this times the largest off-diagonal entry of their row and of their
        transpose's.
    anchors : sequence of (row, x, y) or (row, x, y, z), optional
        Known positions. Two fix the similarity of their piece, a third, not in line, the mirror image. Elasticity
        knows its axes: two fix all.
    tensor : (kxx, kxy, kyy), optional
        A belongs to div(K grad) with this constant K; needs an orientation.
    direction : (row, row, degrees), optional
        Angle from the x axis of the line between two points.
    handed : {"left", "right"}, optional
        Side of that line, or of the line between two anchors, on which the piece's centroid lies.
    standard_deviations : bool
        Compute error bars: for `noise`, or for the noise that the misfit shows.
    triangulate : bool
        Divide cells of more than three vertices into triangles; the vertices lie on a circle, so that every division
        is a Delaunay triangulation and the matrix does not prefer one.
    block_size : {2, 3}, optional
        Vector-valued matrices: unknowns per node; found where it is not given.
    numbering : {"interleaved", "by component"} or (node_of_row, direction_of_row), optional
        Vector-valued matrices: how the unknowns stand; found where it is not given.
    cells : bool
        Vector-valued matrices: look for elements too, not for coordinates only.
    variable : str, optional
        Name of the variable in a ``.mat`` file.
    threads : int, optional
        Threads of the linear algebra libraries.
    progress : callable, optional
        Called with the name of each stage as it starts.

    Returns
    -------
    Recovery
        Certified or not; look at ``status``.

    Raises
    ------
    InputError
        For options that contradict each other, and files that cannot be read.
    RecoveryError
        If no mesh can be recovered from this matrix.

    Examples
    --------
    Two right triangles, the diagonal stored as an explicit zero:

    >>> import scipy.sparse as sp
    >>> from unassemble import recover
    >>> row, column = [0, 0, 0, 1, 2], [1, 2, 3, 3, 3]
    >>> half = sp.coo_array(([-0.5, -0.5, 0.0, -0.5, -0.5], (row, column)), shape=(4, 4))
    >>> full = sp.coo_array(
    ...     (list(half.data) * 2, (row + column, column + row)), shape=(4, 4)
    ... )
    >>> square = recover(full)
    >>> square.status, len(square.triangles), float(round(square.scale[0], 12))
    ('certified', 2, 1.0)
    """
    _check_options(operator, method, scale, noise, vector=block_size is not None or numbering is not None)
    clock = Clock(progress)
    with clock("read"):
        matrix = A if _is_matrix(A) else read_matrix(A, variable=variable)
    with clock("check"):
        checked = check_matrix(matrix, drop_zeros=drop_zeros, noise=noise)
    scalar_only = {
        "method": method, "scale": scale, "noise": noise, "tensor": tensor, "direction": direction,
        "handed": handed, "standard_deviations": standard_deviations,
    }  # fmt: skip

    def scalar(part: OperatorMatrix, known: Sequence[Any] | None) -> Recovery:
        placement = Placement.checked(part.n, known, tensor, direction, handed)
        return _recover(
            part,
            placement,
            clock,
            method or "conformal",
            refine,
            scale,
            noise,
            standard_deviations,
            threads,
            triangulate,
        )

    def vector(reading: VectorReading) -> Recovery:
        from .elasticity.serving import serve

        refuse(**scalar_only)
        return serve(checked, reading.numbering, clock, anchors=anchors, choice=reading.why, cells=cells, scalar=scalar)

    with thread_limit(threads):
        if operator == "elasticity" or block_size is not None or numbering is not None:
            refuse(**scalar_only)
            with clock("numbering"):
                reading = asked_for(checked, block_size, numbering)
            return vector(reading)
        at_sight = vector_valued(checked) if operator == "auto" else None
        if at_sight is not None:
            return vector(at_sight)
        try:
            return scalar(checked, anchors)
        except RecoveryError as error:
            second = second_reading(checked) if operator == "auto" else None
            if second is None:
                raise
            try:
                return vector(second)
            except (RecoveryError, InputError):  # options may be for scalar matrices only
                raise error from None


def _check_options(
    operator: str, method: str | None, scale: float | None, noise: float | None, *, vector: bool
) -> None:
    if operator not in OPERATORS:
        known = " or ".join(map(repr, OPERATORS))
        raise InputError(f"the operator {operator!r} is not available in this version: use {known}")
    if vector and operator == "laplacian":
        raise InputError("block size and numbering belong to vector-valued matrices, not to the operator 'laplacian'")
    if method not in (None, "conformal", "angles"):
        raise InputError(f"the method {method!r} is not available in this version: use 'conformal' or 'angles'")
    if scale is not None and not (np.isfinite(scale) and scale != 0):
        raise InputError(f"the scale is a finite nonzero number, not {scale}")
    if noise is not None and not (np.isfinite(noise) and noise > 0):
        raise InputError(f"the noise is a positive standard deviation, not {noise}")


def _is_matrix(A: Any) -> bool:
    return not isinstance(A, (str, PathLike)) and not hasattr(A, "read")


def _recover(
    stored: OperatorMatrix,
    placement: Placement,
    clock: Clock,
    method: str,
    refine: bool,
    scale: float | None,
    noise: float | None,
    standard_deviations: bool,
    threads: int | None,
    triangulate: bool,
) -> Recovery:
    # With a tensor, c L is what is left of c div(K grad): its factor is c sqrt(det K).
    stretch = placement.tensor.root_determinant if placement.tensor else 1.0
    known = None if scale is None else scale * stretch
    with clock("topology"):
        numbering = local_numbering(stored.n, stored.edges)
        analyse: AnalysisAhead | None = None
        # Most matrices are those of a single piece, and its pencil has their pattern. Others may be large and dense,
        # or lack the diagonals of their cells.
        planar = method == "conformal" and len(stored.edges) < 3 * stored.n
        if planar and triangles_everywhere(stored.n, numbering.edges):
            analyse = AnalysisAhead(pencil_pattern(stored.n, numbering.edges), threads)
        topology = surfaces(stored.n, stored.edges, numbering)
    matrix, topology, meshes = solve(
        topology,
        stored,
        clock,
        method=method,
        scale=known,
        refine=refine,
        rounding=noise is None,
        analyse=analyse or factorisation,
    )
    with clock("place"):
        placed, notes = _place(topology, placement, meshes)
        mesh = JoinedMesh.of(topology, placed, np.array([m.scale for m in meshes]) / stretch)
    with clock("certify"):
        certificate = certificates.certify(
            stored.edges,
            stored.entries,
            mesh.points,
            mesh.triangles,
            mesh.scale[mesh.triangle_piece],
            (placement.tensor.kxx, placement.tensor.kxy, placement.tensor.kyy) if placement.tensor else None,
        )
        freedom = _freedom(topology, scale)
        chi_square = certificates.chi_square_verdict(certificate.differences, noise, freedom) if noise else None
        factors = np.array([m.scale for m in meshes])
        # A misfit at rounding level, or one that noise explains, hides no wrong entry.
        search = not passes(certificate, chi_square, factors)
        search |= (noise is None or freedom <= 0) and certificate.backward_error > certificates.SUSPICIOUS
        evidence = weigh(
            topology,
            matrix,
            meshes,
            certificate,
            freedom,
            free_scale=scale is None,
            search=search,
            rounding=noise is None,
        )
    deviations = None
    if standard_deviations:
        with clock("deviations"):
            sigma = noise or pooled_noise(topology, matrix, meshes, freedom)
            deviations = _deviations(topology, placement, placed, meshes, sigma, scale is None)
    trouble = [note for m in meshes for note in m.notes]
    status, reason = verdict(topology, certificate, chi_square, matrix, evidence, factors, trouble)
    if status == "certified" and len(topology.vanished) > (topology.polygons.size - 3).sum():
        z = mesh.points @ [1, 1j]
        others = exchanges(
            stored,
            mesh.triangles[~mesh.in_polygon],
            mesh.polygons,
            placement.tensor.to_laplacian(z) if placement.tensor else z,
            stretch * mesh.scale[np.maximum(mesh.component, 0)],
            scale_known=scale is not None,
        )
        if others:
            status, reason = ambiguous(others, certificate)
    worst, misfits = certificate.worst(10 if status == "uncertified" else 0, noise=noise, first=evidence.suspects)
    if chi_square and evidence.noise is not None and evidence.noise < 0.5 * chi_square["sigma"]:
        notes.append(f"the noise given is generous: the misfit is that of a standard deviation of {evidence.noise:.2g}")
    polygons = Polygons.none() if triangulate else mesh.polygons
    return Recovery(
        points=mesh.points,
        triangles=mesh.triangles if triangulate else mesh.triangles[~mesh.in_polygon],
        component=mesh.component,
        hinges=topology.hinges,
        scale=mesh.scale,
        polygons_offsets=polygons.offsets,
        polygons_data=polygons.vertices,
        boundary=mesh.boundary,
        boundary_offsets=mesh.boundary_offsets,
        node_status=(topology.multiplicity == 0).astype(np.int8),
        status=status,
        reason=reason,
        operator="anisotropic laplacian" if placement.tensor else "laplacian",
        backward_error=certificate.backward_error,
        n_holes=topology.n_holes,
        timings=clock.timings,
        warnings=(*matrix.warnings, *notes),
        worst_entries=worst,
        worst_misfits=misfits,
        standard_deviations=deviations,
        chi_square=chi_square,
        estimated_noise=evidence.noise,
        suspects=evidence.suspects,
    )


def _place(topology: Topology, placement: Placement, meshes: list[PieceMesh]) -> tuple[list[NDArray], list[str]]:
    """Every piece in its final frame, hinges joined; and what is to be said about it."""
    placed, notes = [], []
    for label, (piece, mesh) in enumerate(zip(topology.pieces, meshes, strict=True)):
        z, remarks = placement.apply(piece, mesh.z)
        placed.append(z)
        prefix = f"piece {label}: " if len(meshes) > 1 else ""
        notes += [prefix + remark for remark in (*mesh.notes, *remarks)]
    known = np.array([placement.known_positions(piece) for piece in topology.pieces])
    placed = join(topology, placed, known)
    notes += placement.unused(topology)
    notes += [*_topology_notes(topology), *_vanished_notes(topology), *topology.failures]
    return placed, notes


def _topology_notes(topology: Topology) -> list[str]:
    notes = []
    if len(topology.pieces) > 1:
        notes.append(
            f"{len(topology.pieces)} pieces: the matrix does not say how they lie relative to each other, "
            "so each has a frame of its own"
        )
    if len(topology.hinges):
        notes.append(f"{len(topology.hinges)} vertices join pieces that share nothing else: {_some(topology.hinges)}")
    if len(topology.undetermined):
        notes.append(
            f"{len(topology.undetermined)} rows belong to no triangle and have no position: "
            f"{_some(topology.undetermined)}"
        )
    return notes


def _vanished_notes(topology: Topology) -> list[str]:
    notes = []
    polygons = topology.polygons
    if polygons.count:
        notes.append(
            f"{polygons.count} cells have more than three vertices, on one circle: entries on their diagonals "
            "vanish whichever way they are divided, so any division into triangles gives the same matrix"
        )
    diagonals = int((polygons.size - 3).sum())
    if len(topology.vanished) > diagonals:
        count = len(topology.vanished) - diagonals
        notes.append(f"{count} boundary edges, which face right angles, have no entry in the matrix")
    return notes


def _some(rows: NDArray, count: int = 8) -> str:
    return ", ".join(map(str, rows[:count])) + (", ..." if len(rows) > count else "")


def _freedom(topology: Topology, scale: float | None) -> int:
    """Entries less fitted unknowns: 2 v - 4 coordinates of each piece, and its c."""
    unknowns = sum(2 * piece.n_vertices - 4 + (scale is None) for piece in topology.pieces)
    return len(topology.edges) - unknowns


def _deviations(
    topology: Topology,
    placement: Placement,
    placed: list[NDArray],
    meshes: list[PieceMesh],
    sigma: float,
    free_scale: bool,
) -> NDArray:
    """(n, 2) standard deviations in the final frame."""
    tensor = placement.tensor
    result = np.full((topology.n_vertices, 2), np.nan)
    for piece, z, mesh in reversed(list(zip(topology.pieces, placed, meshes, strict=True))):
        covariance = coordinate_covariances(
            piece,
            tensor.to_laplacian(z) if tensor else z,
            sigma=sigma / abs(mesh.scale),
            free_scale=free_scale,
            stretch=tensor.root if tensor else None,
            spread=mesh.spread,
        )
        result[piece.vertices] = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return result
