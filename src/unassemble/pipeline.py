"""The door: options, file, checks, and which operator's recovery a matrix is for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any

from .clock import Clock
from .errors import InputError, NotPlanarError, RecoveryError
from .linalg import threads as thread_limit
from .matrix import OperatorMatrix, check_matrix, read_matrix
from .operators import VectorReading, about_translations, asked_for, refuse, second_reading, vector_valued
from .options import check_options, listed_anchors
from .outputs import Recovery
from .recovery import PlanarMesh
from .scalar import ScalarOptions, recover_scalar
from .scalar.placement import Direction, Placement


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
    :func:`unassemble.elasticity.recover_elasticity`. And frames, shells and plates, whose nodes have rotations beside
    displacements; see :mod:`unassemble.structures`.

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
        Compute error bars: for `noise`, the rounding that entries show, or the noise that the misfit shows.
    triangulate : bool
        Divide cells of more than three vertices into triangles; the vertices lie on a circle, so that every division
        is a Delaunay triangulation and the matrix does not prefer one.
    block_size : {2, 3, 6}, optional
        Vector-valued matrices: unknowns per node; found where it is not given. Six are displacements and rotations.
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
    check_options(
        operator=operator,
        method=method,
        scale=scale,
        noise=noise,
        drop_zeros=drop_zeros,
        tensor=tensor,
        block_size=block_size,
        numbering=numbering,
        threads=threads,
    )
    anchors = listed_anchors(anchors)
    clock = Clock(progress)
    with clock("read"):
        matrix = A if _is_matrix(A) else read_matrix(A, variable=variable)
    with clock("check"):
        checked = check_matrix(matrix, drop_zeros=drop_zeros, noise=noise)
    scalar_only = {
        "method": method, "scale": scale, "noise": noise, "tensor": tensor, "direction": direction,
        "handed": handed, "standard_deviations": standard_deviations,
    }  # fmt: skip

    def scalar(part: OperatorMatrix, known: Sequence[Any] | None) -> PlanarMesh:
        placement = Placement.checked(part.n, known, tensor, direction, handed)
        options = ScalarOptions(
            method or "conformal",
            refine=refine,
            scale=scale,
            noise=noise,
            standard_deviations=standard_deviations,
            threads=threads,
            triangulate=triangulate,
        )
        return recover_scalar(part, placement, clock, options)

    def vector(reading: VectorReading) -> Recovery:
        from .vector import recover_vector

        refuse(**scalar_only)
        return recover_vector(checked, reading, clock, anchors=anchors, cells=cells, scalar=scalar)

    with thread_limit(threads):
        if operator == "elasticity" or block_size is not None or numbering is not None:
            refuse(**scalar_only)
            with clock("numbering"):
                reading = asked_for(checked, block_size, numbering)
            return vector(reading)
        at_sight = vector_valued(checked) if operator == "auto" else None
        if at_sight is not None:
            return vector(at_sight)
        found: Recovery | None = None
        failure: RecoveryError | None = None
        try:
            found = scalar(checked, anchors)
        except RecoveryError as error:
            failure = error
        # Rows that no mesh explains may be those of nodes: a straight beam's fall apart into planar graphs.
        doubtful = found is None or (not found.certified and found.node_status.any())
        second = second_reading(checked) if operator == "auto" and doubtful else None
        if second is not None:
            try:
                other = vector(second)
            except (RecoveryError, InputError):  # options may be for scalar matrices only
                pass
            else:
                found = other if found is None or other.certified else found
        if found is None:
            assert failure is not None
            if operator == "auto" and isinstance(failure, NotPlanarError):
                why = about_translations(checked)
                if why:
                    raise NotPlanarError(f"the graph of the matrix is not planar; {why}", failure.witness) from failure
            raise failure
        return found


def _is_matrix(A: Any) -> bool:
    return not isinstance(A, (str, PathLike)) and not hasattr(A, "read")
