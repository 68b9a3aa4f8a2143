"""Pairs of quadratic triangles whose four corners lie on a circle: the side between them has the weight zero.

Of such a side, where zeros are not stored, nothing is left but the entries of the node in its middle with those on the
four sides around. These are coupled to each other within each triangle, unless it has a right angle there; then only
the numbers tell the diagonal: the entries of the middle with two sides of a right triangle have the product 16 c^2 / 9
(w at these sides is half the tangent of one angle and half its inverse, the entries are -8/3 c w). In a rectangle both
diagonals have that, and the matrix is the same for either.
"""

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elements.cliques import Graph
from ..matrix import OperatorMatrix
from ..topology.keys import pair_keys


def halves(matrix: OperatorMatrix, nonzero: Graph) -> tuple[NDArray[np.int64], NDArray[np.int64] | None]:
    """All of these triangles; and with one pair, the one of which the numbers say least, divided the other way.

    `nonzero`: graph of the entries that are not zero.

    Returns both (m, 6), rows increasing within a cell; the second is None where the graph tells all diagonals.
    """
    ring = _rings(nonzero)
    key = matrix.edges @ [matrix.n, 1]
    at_sides = np.searchsorted(key, pair_keys(matrix.n, ring[:, 8:], ring[:, 4:8]))
    one, two, three, four = matrix.entries[at_sides].T
    differ = np.abs([one * two - three * four, two * three - four * one])
    told = nonzero.coupled(ring[:, [4, 5]], ring[:, [5, 6]])
    turned = told[:, 1] | (~told[:, 0] & (differ[1] < differ[0]))
    if told.any(axis=1).all():
        return _triangles(ring, turned), None
    says = np.where(told.any(axis=1), np.inf, np.abs(differ[0] - differ[1]) / np.abs(one * three))
    again = turned.copy()
    again[np.argmin(says)] ^= True
    return _triangles(ring, turned), _triangles(ring, again)


def _triangles(ring: NDArray[np.int64], turned: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(2 k, 6) triangles of the cells (k, 9), divided from their first corner to the third, or else between others."""
    pairs = [[0, 1, 2, 4, 5, 8], [2, 3, 0, 6, 7, 8]], [[1, 2, 3, 5, 6, 8], [3, 0, 1, 7, 4, 8]]
    return np.sort(np.where(turned[:, None, None], ring[:, pairs[1]], ring[:, pairs[0]]).reshape(-1, 6), axis=1)


def _rings(graph: Graph) -> NDArray[np.int64]:
    """(k, 9) corners around each cell, the nodes on its sides, each after its corner, and the node in the middle."""
    middle = np.flatnonzero(np.diff(graph.start) == 4)
    sides = graph.col[graph.start[middle][:, None] + np.arange(4)]
    pairs = sum(graph.coupled(sides[:, a], sides[:, b]).astype(int) for a, b in combinations(range(4), 2))
    middle, sides = middle[pairs % 2 == 0], sides[pairs % 2 == 0]
    open_graph = graph.closed - sp.eye_array(graph.n, dtype=np.int32, format="csr")
    several = sp.csr_array(sum(open_graph[column] for column in sides.T))
    several.data = (several.data == 2).astype(np.int32)
    several.eliminate_zeros()
    count = np.diff(several.indptr)
    found = [np.empty((0, 9), np.int64)]
    for size in range(4, 9):  # at a corner of three cells the side between the other two is coupled to two of ours, too
        some = np.flatnonzero(count == size)
        nodes = several[some].indices.reshape(-1, size).astype(np.int64)
        for four in combinations(range(size), 4):
            found.append(_closed(graph, nodes[:, four], sides[some], middle[some]))
    return np.concatenate(found)


def _closed(graph: Graph, corners: NDArray, sides: NDArray, middle: NDArray) -> NDArray[np.int64]:
    """Those of these cells whose corners and sides make a ring, in its order."""
    around = graph.coupled(corners[:, :, None], corners[:, None, :])
    across = ~around & ~np.eye(4, dtype=bool)
    good = (around.sum(axis=2) == 2).all(axis=1) & (across.sum(axis=2) == 1).all(axis=1)
    corners, sides, middle, around, across = (of[good] for of in (corners, sides, middle, around, across))
    facing, next_ = across[:, 0].argmax(axis=1), around[:, 0].argmax(axis=1)
    order = np.column_stack([np.zeros_like(facing), next_, facing, 6 - facing - next_])
    corners = np.take_along_axis(corners, order, axis=1)
    touching = graph.coupled(sides[:, :, None], corners[:, None, :])
    between = touching[:, :, [0, 1, 2, 3]] & touching[:, :, [1, 2, 3, 0]]
    good = (touching.sum(axis=2) == 2).all(axis=1) & (between.sum(axis=1) == 1).all(axis=1)
    sides = np.take_along_axis(sides, between.argmax(axis=1), axis=1)
    after = graph.coupled(sides, np.roll(sides, -1, axis=1))
    good &= ~graph.coupled(sides[:, :2], sides[:, 2:]).any(axis=1) & (after[:, :2] == after[:, 2:]).all(axis=1)
    good &= ~after[:, :2].all(axis=1)
    return np.column_stack([corners, sides, middle])[good]
