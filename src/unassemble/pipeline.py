"""The whole recovery on one page: check, recognise, solve, place, certify."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import certify as certificates
from .errors import InputError
from .evidence import pooled_noise, weigh
from .joined import JoinedMesh
from .linalg import threads as thread_limit
from .matrix import OperatorMatrix, check_matrix, read_matrix
from .placement import Anchor, Direction, Placement
from .planar.deviations import coordinate_covariances
from .planar.hinges import join
from .planar.piece import PieceMesh
from .recovery import Recovery
from .solving import solve
from .topology import Topology, recognise
from .verdict import passes, verdict

_log = logging.getLogger(__name__)


def recover(
    A: Any,
    *,
    operator: str = "auto",
    method: str | None = None,
    refine: bool = True,
    scale: float | None = None,
    noise: float | None = None,
    drop_zeros: float | None = None,
    anchors: Sequence[Anchor] | None = None,
    tensor: tuple[float, float, float] | None = None,
    direction: Direction | None = None,
    handed: str | None = None,
    standard_deviations: bool = False,
    variable: str | None = None,
    threads: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Recovery:
    """Recover the planar triangle mesh of A = c L + D.

    L is the stiffness matrix of the Laplacian with linear elements and natural boundary conditions, c any
    nonzero number and D any diagonal matrix, both unknown.

    Parameters
    ----------
    A : sparse matrix or array, ndarray, path, or "-"
        A matrix; or a file with one: Matrix Market, scipy's ``.npz``, ``.mat``; ``"-"`` reads Matrix Market from
        standard input. Explicit zeros are structure.
    operator : {"auto", "laplacian"}
        Which operator A belongs to.
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
    anchors : sequence of (row, x, y), optional
        Known positions. Two fix the similarity of their piece, a third, not in line, the mirror image.
    tensor : (kxx, kxy, kyy), optional
        A belongs to div(K grad) with this constant K; needs an orientation.
    direction : (row, row, degrees), optional
        Angle from the x axis of the line between two points.
    handed : {"left", "right"}, optional
        Side of that line, or of the line between two anchors, on which the piece's centroid lies.
    standard_deviations : bool
        Compute error bars: for `noise`, or for the noise that the misfit shows.
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
    _check_options(operator, method, scale, noise)
    clock = _Clock(progress)
    with clock("read"):
        matrix = A if _is_matrix(A) else read_matrix(A, variable=variable)
    with clock("check"):
        checked = check_matrix(matrix, drop_zeros=drop_zeros, noise=noise)
    placement = Placement.checked(checked.n, anchors, tensor, direction, handed)
    with thread_limit(threads):
        return _recover(checked, placement, clock, method or "conformal", refine, scale, noise, standard_deviations)


def _check_options(operator: str, method: str | None, scale: float | None, noise: float | None) -> None:
    if operator not in ("auto", "laplacian"):
        raise InputError(f"the operator {operator!r} is not available in this version: use 'auto' or 'laplacian'")
    if method not in (None, "conformal", "angles"):
        raise InputError(f"the method {method!r} is not available in this version: use 'conformal' or 'angles'")
    if scale is not None and not (np.isfinite(scale) and scale != 0):
        raise InputError(f"the scale is a finite nonzero number, not {scale}")
    if noise is not None and not (np.isfinite(noise) and noise > 0):
        raise InputError(f"the noise is a positive standard deviation, not {noise}")


def _is_matrix(A: Any) -> bool:
    return not isinstance(A, (str, PathLike)) and not hasattr(A, "read")


def _recover(
    matrix: OperatorMatrix,
    placement: Placement,
    clock: _Clock,
    method: str,
    refine: bool,
    scale: float | None,
    noise: float | None,
    standard_deviations: bool,
) -> Recovery:
    # With a tensor, c L is what is left of c div(K grad): its factor is c sqrt(det K).
    stretch = placement.tensor.root_determinant if placement.tensor else 1.0
    known = None if scale is None else scale * stretch
    with clock("topology"):
        topology = recognise(matrix.n, matrix.edges)
    topology, meshes = solve(topology, matrix, clock, method=method, scale=known, refine=refine, rounding=noise is None)
    with clock("place"):
        placed, notes = _place(topology, placement, meshes)
        mesh = JoinedMesh.of(topology, placed, np.array([m.scale for m in meshes]) / stretch)
    with clock("certify"):
        certificate = certificates.certify(
            matrix.edges,
            matrix.entries,
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
    worst, misfits = certificate.worst(10 if status == "uncertified" else 0, noise=noise, first=evidence.suspects)
    if chi_square and evidence.noise is not None and evidence.noise < 0.5 * chi_square["sigma"]:
        notes.append(f"the noise given is generous: the misfit is that of a standard deviation of {evidence.noise:.2g}")
    return Recovery(
        points=mesh.points,
        triangles=mesh.triangles,
        component=mesh.component,
        hinges=topology.hinges,
        scale=mesh.scale,
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
    notes += [*_topology_notes(topology), *topology.failures]
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


@dataclass
class _Clock:
    """Seconds by stage; tells a listener as each begins."""

    listener: Callable[[str], None] | None
    timings: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        if self.listener:
            self.listener(stage)
        start = time.perf_counter()
        yield
        self.timings[stage] = time.perf_counter() - start
        _log.info("%s: %.3g s", stage, self.timings[stage])
