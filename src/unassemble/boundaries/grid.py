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

_AXES = np.array([(1, 0), (0, 1)])
_DIAGONALS = np.array([(1, 1), (-1, 1)])
STEPS = {4: _AXES, 6: np.array([(1, 0), (0, 1), (-1, 1)]), 8: np.vstack([_AXES, _DIAGONALS])}
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
        seed = _Rows.of(sp.csr_array(graph + (_common(graph) == 2)) if neighbours == 4 else graph)  # with diagonals
        if seed is None or not len(seed.rows):
            return None
        at = _spread(seed, n)
        if at is None:
            return None
        along, steps = (at[edges[:, 1]] - at[edges[:, 0]])[:, None], STEPS[neighbours]
        match = (along == steps).all(axis=2) | (along == -steps).all(axis=2)
        shifted = (at - at.min(axis=0)) @ [1, 2 * n]
        if not match.any(axis=1).all() or len(np.unique(shifted)) < n:
            return None
        return cls(neighbours, at, match.argmax(axis=1))


def _common(graph: sp.csr_array) -> sp.csr_array:
    """Numbers of common neighbours of rows that are none."""
    common = (graph @ graph).tocsr()
    common.setdiag(0)
    return sp.csr_array(common - common.multiply(graph))


@dataclass(frozen=True, eq=False)
class _Rows:
    """Rows with all their neighbours, and opposite pairs of these."""

    graph: sp.csr_array  # of triangles, or of squares with diagonals
    rows: NDArray[np.int64]  # (k,)
    pairs: NDArray[np.int64]  # (k, 3 or 4, 2)

    @classmethod
    def of(cls, graph: sp.csr_array) -> _Rows | None:
        """None for a graph that is neither of triangles nor of squares with diagonals."""
        degree = np.diff(graph.indptr)
        most = int(degree.max())
        if most not in (6, 8):
            return None
        rows = np.flatnonzero(degree == most)
        around = graph.indices[graph.indptr[rows][:, None] + np.arange(most)].astype(np.int64)
        first, second = np.triu_indices(most, 1)
        one, other = around[:, first], around[:, second]
        common = np.asarray(_common(graph)[one.ravel(), other.ravel()]).reshape(one.shape)
        opposite = common == 1
        good = opposite.sum(axis=1) == (3 if most == 6 else 2)
        if most == 8:  # sides of squares: what is left, and not joined by an edge
            ends = np.zeros((len(rows), most), dtype=bool)
            i, k = np.nonzero(opposite)
            ends[i, first[k]] = ends[i, second[k]] = True
            opposite |= (common > 2) & ~ends[:, first] & ~ends[:, second]
            good &= opposite.sum(axis=1) == 4
        rows, opposite = rows[good], opposite[good]
        pairs = np.stack([one[good][opposite], other[good][opposite]], axis=1).reshape(-1, most // 2, 2)
        apart = np.sort(pairs.reshape(len(rows), most), axis=1)
        good = (apart[:, 1:] != apart[:, :-1]).all(axis=1)
        return cls(graph, rows[good], pairs[good])

    def ring(self) -> dict[int, tuple[int, int]] | None:
        """Coordinates of the first row, at the origin, and of its neighbours; None where they are none of a grid."""
        row, pairs = int(self.rows[0]), self.pairs[0].tolist()
        near = {v: set(_neighbours(self.graph, v)) for v in _neighbours(self.graph, row)}
        if len(pairs) == 3:
            a, not_a = pairs[0]
            (b, not_b), (c, not_c) = (p if p[0] in near[a] else p[::-1] for p in pairs[1:])
            return {row: (0, 0), a: (1, 0), b: (0, 1), not_c: (-1, 1), not_a: (-1, 0), not_b: (0, -1), c: (1, -1)}
        sides = [p for p in pairs if sum(len(near[v] & near.keys()) for v in p) == 8]
        if len(sides) != 2:
            return None
        (a, not_a), (b, not_b) = sides
        at = {row: (0, 0), a: (1, 0), b: (0, 1), not_a: (-1, 0), not_b: (0, -1)}
        corners = {v: [at[w] for w in near[v] & at.keys() if w != row] for v in near.keys() - at.keys()}
        return at | {v: (sum(x for x, _ in ends), sum(y for _, y in ends)) for v, ends in corners.items()}


def _neighbours(graph: sp.csr_array, row: int) -> list[int]:
    return graph.indices[graph.indptr[row] : graph.indptr[row + 1]].tolist()


def _spread(seed: _Rows, n: int) -> NDArray[np.int64] | None:
    """Coordinates of all rows, midpoint by midpoint; None where some are not reached."""
    at, known = np.zeros((n, 2), np.int64), np.zeros(n, dtype=bool)
    number = np.full(n, -1)
    number[seed.rows] = np.arange(len(seed.rows))
    if (start := seed.ring()) is None:
        return None
    new = np.array(list(start))
    at[new], known[new] = list(start.values()), True
    indptr, indices = seed.graph.indptr, seed.graph.indices
    while len(new):
        size = indptr[new + 1] - indptr[new]
        own = np.repeat(np.cumsum(size) - size, size)
        near = indices[np.repeat(indptr[new], size) + np.arange(size.sum()) - own]
        middle = np.unique(np.concatenate([new, near]))
        middle = middle[known[middle] & (number[middle] >= 0)]
        pairs = seed.pairs[number[middle]]
        first, second = known[pairs].transpose(2, 0, 1)
        reached = []
        for one, other, some in ((0, 1, first & ~second), (1, 0, second & ~first)):
            i, k = np.nonzero(some)
            at[pairs[i, k, other]] = 2 * at[middle[i]] - at[pairs[i, k, one]]
            reached.append(pairs[i, k, other])
        new = np.unique(np.concatenate(reached))
        known[new] = True
    for row in np.flatnonzero(~known).tolist():  # corners of a single triangle
        beside = [v for v in _neighbours(seed.graph, row) if known[v]]
        if len(beside) != 2:
            return None
        shared = set(_neighbours(seed.graph, beside[0])) & set(_neighbours(seed.graph, beside[1])) - {row}
        if len(shared) != 1 or not known[apex := shared.pop()]:
            return None
        at[row] = at[beside].sum(axis=0) - at[apex]
    return at
