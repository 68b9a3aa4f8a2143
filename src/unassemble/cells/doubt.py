"""Which parts of a matrix their triangles do not explain."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..errors import RecoveryError, SolverError
from ..matrix import OperatorMatrix
from ..planar.piece import PieceMesh
from ..planar.polish import CAREFUL, SHORT, polish
from ..tolerances import ALIKE, SMALL
from ..topology import Piece, Topology
from ..topology.numbering import connected
from .judge.labelling import even
from .judge.within_errors import misfits

_WIDE = 200  # rows of a matrix on which the misfit of a wrong cell stays near it


Outcome = PieceMesh | RecoveryError
"""Positions of a piece, or why there are none."""

Attempt = Callable[[Piece], Outcome]
"""Solves a piece, each only once."""

Solved = list[tuple[Piece, Outcome]]


def in_doubt(
    matrix: OperatorMatrix, topology: Topology, attempt: Attempt, scale: float | None, noise: float | None
) -> NDArray[np.bool_]:
    """(n,) rows of components with nonzero entries on no triangle, or entries that do not fit.

    A misfit that is small and spread evenly, at the latest after a short polish, is that of errors in the entries, and
    raises no doubt. Pieces of components that are in doubt without it are not solved. `scale` is c, where it is known,
    and `noise` the standard deviation of the entries' errors.
    """
    doubtful = unexplained(matrix, topology)
    solved = [(piece, attempt(piece)) for piece in topology.pieces if not doubtful[piece.vertices[0]]]
    misfit = misfits(matrix.n, matrix.edges, -matrix.entries, solved)
    rest = np.flatnonzero(~doubtful[matrix.edges[:, 0]])
    misfit = misfit[rest]
    wrong = misfit > ALIKE
    if not wrong.any() or _like_noise(misfit, matrix.n):
        return doubtful
    solved = [(piece, _shortly_polished(matrix, piece, mesh, scale, small_steps=bool(noise))) for piece, mesh in solved]
    if _like_noise(misfits(matrix.n, matrix.edges, -matrix.entries, solved)[rest], matrix.n):
        return doubtful
    return doubtful | _components_of(matrix, rest[wrong])


def _like_noise(misfit: NDArray, n: int) -> bool:
    """Whether a misfit is that of errors in the entries; small meshes spread that of a wrong cell as evenly.

    If less than next to nothing is left, it is noise there too: no wrong cell is known to leave so little.
    """
    return even(misfit) and (n > _WIDE or float(np.sqrt(np.mean(misfit**2))) < SMALL)


def _shortly_polished(
    matrix: OperatorMatrix, piece: Piece, mesh: Outcome, scale: float | None, *, small_steps: bool
) -> Outcome:
    """By a few steps; by small ones where noise may lead large ones to flat triangles."""
    if not isinstance(mesh, PieceMesh):
        return mesh
    weights = -matrix.entries[piece.edge_rows]
    try:
        found = polish(piece, weights, mesh.z, scale=scale, options=CAREFUL if small_steps else SHORT)
    except SolverError as error:
        return error
    return PieceMesh(found.z, found.scale)


def unexplained(matrix: OperatorMatrix, topology: Topology) -> NDArray[np.bool_]:
    """(n,) rows of components with nonzero entries on no triangle."""
    bare = topology.bare_edges
    return _components_of(matrix, bare[matrix.entries[bare] != 0])


def _components_of(matrix: OperatorMatrix, rows: NDArray) -> NDArray[np.bool_]:
    """(n,) rows of the connected components that have one of the given edges."""
    chosen = np.zeros(matrix.n, dtype=bool)
    if not len(rows):
        return chosen
    label = connected(matrix.n, *matrix.edges.T)[1]
    chosen[label[matrix.edges[rows, 0]]] = True
    return chosen[label]
