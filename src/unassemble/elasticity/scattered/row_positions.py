"""Rows whose directions are known, but not their nodes: each is placed by itself, and those of one node coincide.

The identities hold row by row, so that a row can have a position of its own. Where several nodes couple to the same
unknowns nothing else tells which of their rows belong together.
"""

from __future__ import annotations

from itertools import combinations, permutations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...errors import GeometryError
from ..nodal import NodalMatrix, determined, nodal_matrix
from ..nullspace.placing import placed
from ..nullspace.solution import Solution
from ..rows.grouping import by_first_row, without_doubles
from ..rows.numbering import Numbering
from ..rows.pieces import pieces
from .exchange import fullest
from .patterns import by_direction
from .plane_rows import of_planes
from .row_equations import Sums, equations, sums_of
from .trials import joined_by_trial

_APART = 1e-6  # of the mean edge length, up to which two positions are one
_ROUNDS = 4


def single_nodes(group: NDArray[np.int64], direction: NDArray[np.int64], d: int) -> NDArray[np.int64]:
    """(N,) nodes of rows of the same pattern with one row of each direction at most; all other rows by themselves."""
    count = by_direction(group, direction, d)
    lone = np.asarray((count <= 1).all(axis=1))[group]
    return by_first_row(np.where(lone, group, len(group) + np.arange(len(group))))


def placed_together(
    matrix: sp.csr_array,
    live: NDArray[np.bool_],
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    d: int,
    open_row: NDArray[np.bool_] | None = None,
    *,
    ordered: bool = False,
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Nodes after rows of the same pattern were joined whose positions coincide, and rows that are left in doubt.

    Parameters
    ----------
    matrix : (N, N) sparse
        Entries that vanish are stored.
    live : (N,) bool
        Rows that count.
    group : (N,) int64
        Rows that couple to the same unknowns.
    node, direction : (N,) int64
        Rows of one node belong together; those of others may, too.
    d : int
    open_row : (N,) bool, optional
        Rows that may belong to one node with others; all where it is not given.
    ordered : bool
        Whether the rows of each direction stand in the order of nodes.

    Returns
    -------
    node : (N,) int64
    open_row : (N,) bool
    """
    identity = ~live
    may = live if open_row is None else live & open_row
    sums = sums_of(matrix, live, group, direction, d)
    countable = fullest(matrix, live, group, direction, d)[group] >= 0
    everywhere = np.zeros((len(node), d), dtype=np.int64)

    def piece_of(node: NDArray[np.int64]) -> NDArray[np.int64]:
        return pieces(node, direction, d) if ordered else everywhere

    for _ in range(_ROUNDS):
        open_row = _open(group, node, direction, piece_of(node)) & may
        if not open_row.any():
            break
        nodal = nodal_matrix(matrix, Numbering(d, node, direction, identity, "pattern", 1.0, 1.0))
        solution = _row_by_row(nodal, sums, group, node, direction)
        again, settled = node, np.zeros(len(node), dtype=bool)
        if solution is not None:
            again, settled = _joined(solution, sums, group, node, direction, open_row, ordered=ordered)
            may = may & ~settled
        piece = piece_of(again)
        again = _remaining(group, again, direction, piece, may & countable)
        if solution is not None and again.max() == node.max():
            again, settled = joined_by_trial(matrix, sums, solution, group, node, direction, piece, open_row & may)
            may = may & ~settled
        if again.max() == node.max():
            break
        node = again
    return node, _open(group, node, direction, piece_of(node)) & may


def _open(
    group: NDArray[np.int64], node: NDArray[np.int64], direction: NDArray[np.int64], piece: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(N,) rows of nodes that lack a direction which others of the same pattern, that lack theirs, may give them.

    Rows of different pieces (N, d) of the order may not; see :mod:`..rows.pieces`.
    """
    order, d = piece.shape
    absent = by_direction(node, direction, d) == 0
    found = np.zeros(len(absent), dtype=bool)
    for c, b in permutations(range(d), 2):
        r, s = (np.flatnonzero((direction == one) & absent[node, other]) for one, other in ((c, b), (b, c)))
        offered = np.isin(group[r] * (order + 1) + piece[r, b], group[s] * (order + 1) + piece[s, c])
        found[node[r[offered]]] = True
    return found[node]


def _row_by_row(
    nodal: NodalMatrix, sums: Sums, group: NDArray[np.int64], node: NDArray[np.int64], direction: NDArray[np.int64]
) -> Solution | None:
    """Positions of nodes each of which may be some rows of one only; None where none are exact."""
    try:
        solution = placed(*equations(nodal, sums, group, node, direction), None)
    except GeometryError:
        return None
    return solution if solution.exact else None


def _joined(
    solution: Solution,
    sums: Sums,
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    open_row: NDArray[np.bool_],
    *,
    ordered: bool,
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Nodes after those in doubt were joined that have the same pattern and lie in one place, and rows beyond doubt.

    And rows of unknown place, to the nodes that do not lie in the plane of those that lack their direction.
    """
    n, d = int(node.max()) + 1, sums.whole.shape[1]
    nobody = np.zeros(len(node), dtype=bool)
    kind = np.full(n, -1)
    kind[node[open_row]] = group[open_row]
    some = np.flatnonzero(determined(solution.points[:n]) & (kind >= 0))
    if len(some) < 2:
        return node, nobody
    pairs = some[cKDTree(solution.points[some]).query_pairs(_APART, output_type="ndarray")]
    alike = (kind[pairs[:, 0]] == kind[pairs[:, 1]]) & (np.ptp(solution.component[pairs], axis=1) == 0)
    first, second = pairs[alike].T
    link = sp.csr_array((np.ones(len(first), np.int8), (first, second)), shape=(n, n))
    count, place = sp.csgraph.connected_components(link, directed=False)
    here = place[node].astype(np.int64)
    points, gone = np.full((count, d), np.nan), np.zeros((count, d), dtype=bool)
    known = determined(solution.points[:n])
    points[place[known]] = solution.points[:n][known]
    gone[here] = sums.gone
    label, settled = of_planes(points, gone, group, here, direction, open_row, ordered=ordered)
    joined, torn = without_doubles(label, node, direction, d)
    return joined, settled & ~torn


def _remaining(
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    piece: NDArray[np.int64],
    may: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """(N,) nodes after all that is left of a pattern was joined where that is one row of each direction, uncrossed."""
    d = piece.shape[1]
    left = np.flatnonzero((by_direction(node, direction, d) == 0).any(axis=1)[node] & may)
    rest = by_direction(group[left], direction[left], d, int(group.max()) + 1)
    last = (rest == 1).all(axis=1)
    row = np.zeros(rest.shape, dtype=np.int64)
    row[group[left], direction[left]] = left
    for c, b in combinations(range(d), 2):
        last &= piece[row[:, c], b] == piece[row[:, b], c]
    left = left[last[group[left]]]
    label = node.copy()
    label[left] = len(node) + group[left]
    return by_first_row(label)
