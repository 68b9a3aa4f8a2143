"""Integer coordinates of the vertices of a grid, from its graph alone.

A row of a grid has four neighbours (squares), six (triangles) or eight (squares with both diagonals). Squares get
their diagonals first: two rows are opposite in a square if they have just two common neighbours. In what there is then
two neighbours a, c of a row b that has all its neighbours lie opposite each other, a + c = 2 b, where b is the only
common neighbour (all three directions of triangles, both diagonals of squares), or where neither is on a diagonal and
no edge joins them. From one row and its neighbours these midpoints lead everywhere, in about as many rounds as the grid
is wide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..topology.keys import distinct, runs

STEPS = {k: np.array([(1, 0), (0, 1), *more]) for k, more in ((4, ()), (6, ((-1, 1),)), (8, ((1, 1), (-1, 1))))}
"""Directions of edges, up to sign, by the number of neighbours of a row inside."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Vertices of a plane lattice."""

    neighbours: int  # 4, 6 or 8, of a row inside
    at: NDArray[np.int64]  # (n, 2) coordinates of each row, all different
    step: NDArray[np.int64]  # (e,) direction of each edge: a row of ``STEPS[neighbours]``

    @classmethod
    def of(cls, n: int, edges: NDArray[np.int64]) -> Grid | None:
        """The grid that a graph of edges (e, 2) is, with no edge missing between neighbours; None where it is none."""
        neighbours = int(np.bincount(edges.ravel(), minlength=n).max())
        if neighbours not in STEPS or len(edges) > neighbours * n // 2:
            return None
        both = np.concatenate([edges, edges[:, ::-1]]).astype(np.int32)
        graph = sp.coo_array((np.ones(len(both), np.int8), both.T), shape=(n, n)).tocsr()
        at = _coordinates(sp.csr_array(graph + (_common(graph) == 2)) if neighbours == 4 else graph)  # with diagonals
        if at is None:
            return None
        along, steps = (at[edges[:, 1]] - at[edges[:, 0]])[:, None], STEPS[neighbours]
        match = (along == steps).all(axis=2) | (along == -steps).all(axis=2)
        shifted = (at - at.min(axis=0)) @ [1, 2 * n]
        if not match.any(axis=1).all() or len(distinct(shifted)) < n:
            return None
        return cls(neighbours, at, match.argmax(axis=1))


def _common(graph: sp.csr_array) -> sp.csr_array:
    """Numbers of common neighbours of rows that are none."""
    common = (graph @ graph).tocsr()
    common.setdiag(0)
    return sp.csr_array(common - common.multiply(graph))


def _opposite(graph: sp.csr_array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows (k,) with all their neighbours, and opposite pairs of these, (k, 3 or 4, 2).

    The graph is one of triangles, or of squares with diagonals.
    """
    degree = np.diff(graph.indptr)
    most = int(degree.max())
    rows = np.flatnonzero(degree == most)
    around = graph.indices[graph.indptr[rows][:, None] + np.arange(most)].astype(np.int64)
    first, second = np.triu_indices(most, 1)
    one, other = around[:, first], around[:, second]
    common = np.asarray(_common(graph)[one.ravel(), other.ravel()]).reshape(one.shape)
    opposite = common == 1
    if most == 8:  # sides of squares: what is left, and not joined by an edge
        ends = np.zeros((len(rows), most), dtype=bool)
        i, k = np.nonzero(opposite)
        ends[i, first[k]] = ends[i, second[k]] = True
        opposite |= (common > 2) & ~ends[:, first] & ~ends[:, second]
    good = np.count_nonzero(opposite, axis=1) == most // 2
    pairs = np.stack([one[good][opposite[good]], other[good][opposite[good]]], axis=1)
    return rows[good], pairs.reshape(-1, most // 2, 2)


def _neighbours(graph: sp.csr_array, row: int) -> set[int]:
    return set(graph.indices[graph.indptr[row] : graph.indptr[row + 1]].tolist())


def _ring(graph: sp.csr_array, row: int, pairs: list[list[int]]) -> dict[int, tuple[int, int]]:
    """Coordinates of a row, at the origin, and of its neighbours, as they would be in a grid."""
    ring = _neighbours(graph, row)
    near = {v: ring & _neighbours(graph, v) for v in ring}
    (a, not_a), (b, not_b), *_ = sorted(pairs, key=lambda pair: -len(near[pair[0]]))  # diagonals of squares last
    if b not in near[a]:
        b, not_b = not_b, b
    at = {a: (1, 0), b: (0, 1), not_a: (-1, 0), not_b: (0, -1)}
    beside = {v: [at[w] for w in near[v] & at.keys()] for v in ring - at.keys()}
    return at | {row: (0, 0)} | {v: (sum(x for x, _ in ends), sum(y for _, y in ends)) for v, ends in beside.items()}


def _coordinates(graph: sp.csr_array) -> NDArray[np.int64] | None:
    """Coordinates of all rows, (n, 2), midpoint by midpoint; None where some are not reached."""
    if np.diff(graph.indptr).max() not in (6, 8):
        return None
    rows, opposite = _opposite(graph)
    if not len(rows):
        return None
    n = graph.shape[0]
    at, known, number = np.zeros((n, 2), np.int64), np.zeros(n, dtype=bool), np.full(n, -1)
    number[rows] = np.arange(len(rows))
    start = _ring(graph, int(rows[0]), opposite[0].tolist())
    new = np.array(list(start))
    at[new], known[new] = list(start.values()), True
    while len(new):
        size = graph.indptr[new + 1] - graph.indptr[new]
        owner, place = runs(size)
        middle = distinct(np.concatenate([new, graph.indices[graph.indptr[new][owner] + place]]))
        middle = middle[known[middle] & (number[middle] >= 0)]
        pairs = opposite[number[middle]]
        i, k, end = np.nonzero(known[pairs] & ~known[pairs[:, :, ::-1]])
        new = pairs[i, k, 1 - end]
        at[new], known[new] = 2 * at[middle[i]] - at[pairs[i, k, end]], True
        new = distinct(new)
    for row in np.flatnonzero(~known).tolist():  # corners of a single triangle
        beside = [v for v in _neighbours(graph, row) if known[v]]
        if len(beside) != 2 or len(apex := _neighbours(graph, beside[0]) & _neighbours(graph, beside[1]) - {row}) != 1:
            return None
        at[row] = at[beside].sum(axis=0) - at[apex.pop()]
    return at
