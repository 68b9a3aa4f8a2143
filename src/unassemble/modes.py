"""The near-null space of a recovered matrix, whichever room it comes from, and files of it for other solvers."""

from os import PathLike, fspath
from pathlib import Path, PurePath

import numpy as np
import scipy.io
from numpy.typing import NDArray

from .errors import FormatError, InputError, OutputError
from .files import check_target, whole_file
from .recovery import Recovery
from .structures.layouts import SOLIDS, Layout, layout_named
from .words import count_of


def modes_of(recovery: Recovery) -> NDArray[np.float64]:
    """Near-null space of a vector-valued matrix, (N, 3) or (N, 6), rows as in the matrix: PyAMG's ``B``.

    Translations, then rotations; nodes without coordinates get what they have without moving. InputError for scalar
    matrices.
    """
    node, direction = recovery.node_of_row, recovery.direction_of_row
    if node is None or direction is None:
        raise InputError("a scalar matrix has no rigid-body modes: its near-null space is that of the constants")
    return rigid_body_modes(recovery.points, node, direction, layout_named(recovery.operator))


def rigid_body_modes(
    points: NDArray[np.float64],
    node_of_row: NDArray[np.int64],
    direction_of_row: NDArray[np.int64],
    layout: Layout | None = None,
) -> NDArray[np.float64]:
    """Near-null space of an elasticity matrix or that of a structure, in the layout that PyAMG expects.

    `points` (n, d): rows of NaN get what they have without moving, translations, and rotations of the node itself;
    `node_of_row`, `direction_of_row` (N,): a direction of -1 is not known, and gets zeros; `layout`: of structures
    whose nodes have rotations, too. Returns (N, 3) or (N, 6), row by row of the matrix: translations, then rotations
    about the centroid, divided by the radius of gyration, so that none swamps another.
    """
    layout = layout or SOLIDS[points.shape[1]]
    known = np.asarray(np.isfinite(points).all(axis=1))
    x = points - points[known].mean(axis=0) if known.any() else np.zeros_like(points)
    x = np.where(known[:, None], x, 0.0)
    motions = layout.rigid_motions(x)
    motions[:, :, len(layout.displacements) :] /= float(np.sqrt((x**2).sum() / max(known.sum(), 1))) or 1.0
    return np.asarray(motions[node_of_row, direction_of_row] * (direction_of_row >= 0)[:, None])


def save_modes(path: str | PathLike[str], modes: NDArray[np.float64]) -> None:
    """Write a near-null space as numpy's ``.npy``, or as a dense Matrix Market ``.mtx`` (AMGCL's ``-N``).

    OutputError if the name ends otherwise, or the file cannot be written.
    """
    suffix = check_modes(path)
    with whole_file(path, suffix) as draft:
        np.save(draft, modes) if suffix == ".npy" else _write_dense(draft, modes)


def check_modes(path: str | PathLike[str]) -> str:
    """Find out, before long work, whether modes can be written; returns the extension."""
    if (suffix := PurePath(path).suffix.lower()) not in (".npy", ".mtx"):
        raise OutputError(f"rigid-body modes are a .npy or .mtx file, not {fspath(path)!r}")
    check_target(path)
    return suffix


def save_petsc_vec(path: str | PathLike[str], points: NDArray[np.float64]) -> None:
    """Write coordinates as a Vec in PETSc's binary format, node by node, for ``PCSetCoordinates``.

    Big-endian: class identifier 1211214 and length as 32-bit integers, then the values as doubles.
    """
    values = _determined(points).ravel()
    header = np.array([1211214, len(values)], dtype=">i4")
    with whole_file(path, ".petsc") as draft:
        draft.write_bytes(header.tobytes() + values.astype(">f8").tobytes())


def save_amgcl_coordinates(path: str | PathLike[str], points: NDArray[np.float64]) -> None:
    """Write coordinates as a dense Matrix Market array of n rows and d columns, for AMGCL's ``-C``."""
    values = _determined(points)
    with whole_file(path, ".mtx") as draft:
        _write_dense(draft, values)


def _write_dense(path: Path, values: NDArray[np.float64]) -> None:
    with path.open("wb") as file:  # a name would be completed, a file is not
        scipy.io.mmwrite(file, values, precision=17, symmetry="general")


def _determined(points: NDArray[np.float64]) -> NDArray[np.float64]:
    if len(loose := np.flatnonzero(~np.isfinite(points).all(axis=1))):
        raise FormatError(
            f"{count_of(len(loose), 'node has', 'nodes have')} no coordinates (node {loose[0]} for one), and this "
            "format has no way to say so: write the .npz, or the modes, in which such nodes have translations only"
        )
    return points
