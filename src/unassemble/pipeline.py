"""The door: options, file, checks."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from .clock import Clock
from .linalg import threads as thread_limit
from .masses import weighed
from .matrix import check_matrix, is_file, read_matrix
from .options import Direction, FrameOptions, OperatorOptions, ScalarOptions
from .outputs import Recovery
from .progress import StageDisplay, quiet_libraries
from .question import Question


def recover(
    A: Any,
    *,
    operator: str = "auto",
    method: str | None = None,
    refine: bool = True,
    scale: float | None = None,
    noise: float | None = None,
    drop_zeros: float | None = None,
    anchors: Sequence[Any] | Mapping[int, Any] | None = None,
    tensor: tuple[float, float, float] | None = None,
    direction: Direction | None = None,
    handed: str | None = None,
    standard_deviations: bool = False,
    triangulate: bool = False,
    block_size: int | None = None,
    numbering: Any = None,
    cells: bool = True,
    realise: bool = False,
    mass: Any = None,
    variable: str | None = None,
    threads: int | None = None,
    progress: Callable[[str], None] | bool | None = None,
) -> Recovery:
    """Recover the mesh that a matrix was assembled on.

    Scalar: A = c L + D, where L is the stiffness matrix of the Laplacian with linear elements on triangles in the
    plane and natural boundary conditions, c any nonzero number and D any diagonal matrix, both unknown.
    Vector-valued: isotropic linear elasticity in the plane or in space, with supports; see
    :mod:`unassemble.elasticity`. And frames, shells and plates, whose nodes have rotations beside
    displacements; see :mod:`unassemble.structures`. And the Laplacian of triangulated surfaces in space, c L + D, of
    which the edge lengths are found; see :mod:`unassemble.metric`.

    Parameters
    ----------
    A : sparse matrix or array, ndarray, path, or "-"
        A matrix; or a file with one: Matrix Market, scipy's ``.npz``, ``.mat``; ``"-"`` reads Matrix Market from
        standard input. Explicit zeros are structure.
    operator : {"auto", "laplacian", "elasticity", "surface"}
        Which operator A belongs to. ``"auto"`` reads planar meshes as scalar, matrices whose graph is none but
        whose rows form nodes of two or three unknowns as elasticity, and what fits no mesh in the plane but a surface
        in space as that.
    method : {None, "conformal", "angles"}
        How positions are found: by the conformal null vector, the default, or by the 2002 paper's equations for angles.
    refine : bool
        Polish the positions by Gauss-Newton to the level that the entries allow; not those of ``"angles"``, whose
        verdict is their own.
    scale : float, optional
        c, where it is known.
    noise : float, optional
        Standard deviation of independent Gaussian errors in the entries of the upper triangle; the certificate
        becomes a chi-square test. Where both triangles carry errors of their own their mean is fitted, and its
        error is smaller by a factor sqrt(2).
    drop_zeros : float, optional
        Forget stored entries of at most this times the largest off-diagonal entry of their row and of their
        transpose's.
    anchors : sequence of (row, x, y) or (row, x, y, z), or mapping of row to (x, y) or (x, y, z), optional
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
    block_size : {2, 3, 4, 6}, optional
        Vector-valued matrices: unknowns per node; found where it is not given. Four, of straight beams, and six are
        displacements and rotations.
    numbering : {"interleaved", "by component"} or (node_of_row, direction_of_row), optional
        Vector-valued matrices: how the unknowns stand; found where it is not given.
    cells : bool
        Vector-valued matrices: look for elements too, not only where nothing else confirms coordinates.
    realise : bool
        Surfaces: look for coordinates in space that have the edge lengths.
    mass : sparse matrix or array, ndarray, or path, optional
        The mass matrix of the same mesh, which tells its size, or with `anchors` its density; see
        :func:`unassemble.masses.weighed`.
    variable : str, optional
        Name of the variable in a ``.mat`` file.
    threads : int, optional
        Threads of the linear algebra libraries.
    progress : callable or bool, optional
        Called with the name of each stage as it starts; True shows the stage on standard error.

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
    Two right triangles, the diagonal stored as an explicit zero. Without the scale there would be as many unknowns as
    entries, and no certificate:

    >>> import scipy.sparse as sp
    >>> from unassemble import recover
    >>> row, column = [0, 0, 0, 1, 2], [1, 2, 3, 3, 3]
    >>> half = sp.coo_array(([-0.5, -0.5, 0.0, -0.5, -0.5], (row, column)), shape=(4, 4))
    >>> full = sp.coo_array(
    ...     (list(half.data) * 2, (row + column, column + row)), shape=(4, 4)
    ... )
    >>> square = recover(full, scale=1.0)
    >>> square.status, len(square.triangles), float(round(square.scale[0], 12))
    ('certified', 2, 1.0)
    """
    about = OperatorOptions(operator=operator, block_size=block_size, numbering=numbering, cells=cells)
    frame = FrameOptions(anchors=anchors, tensor=tensor, direction=direction, handed=handed)
    planar = ScalarOptions(
        method="conformal" if method is None else method,
        refine=refine,
        scale=scale,
        noise=noise,
        standard_deviations=standard_deviations,
        triangulate=triangulate,
        threads=threads,
    )
    scalar_only = {
        "method": method, "scale": scale, "noise": noise, "tensor": tensor, "direction": direction,
        "handed": handed, "standard_deviations": standard_deviations or None,
    }  # fmt: skip
    given = tuple(name for name, value in scalar_only.items() if value is not None)
    with quiet_libraries(), StageDisplay(enabled=progress is True, wanted=True) as display:
        clock = Clock(progress if callable(progress) else display if progress else None)
        with clock("read"):
            matrix = read_matrix(A, variable=variable) if is_file(A) else A

        def answer(matrix: Any) -> Recovery:
            with clock("check"):
                checked = check_matrix(matrix, drop_zeros=drop_zeros, noise=noise)
            return Question(checked, clock, about, frame, planar, given, realise).answer()

        with thread_limit(threads):
            if mass is None:
                return answer(matrix)
            return weighed(answer, matrix, mass, frame.anchors, frame.tensor and frame.tensor.coefficients)
