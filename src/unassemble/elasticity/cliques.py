"""Candidates for cells: sets of nodes of which each couples to each."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment


class Graph:
    """Neighbours of nodes, with fast answers to "are these two coupled?".

    Parameters
    ----------
    pattern : (n, n) sparse
        Symmetric; the diagonal does not matter.
    """

    def __init__(self, pattern: sp.csr_array):
        coo = pattern.tocoo()
        off = coo.row != coo.col
        order = np.lexsort((coo.col[off], coo.row[off]))
        self.n = pattern.shape[0]
        self.row = coo.row[off][order].astype(np.int64)
        self.col = coo.col[off][order].astype(np.int64)
        self.start = np.searchsorted(self.row, np.arange(self.n + 1))
        self._key = self.row * self.n + self.col

    def coupled(self, i: NDArray, j: NDArray) -> NDArray[np.bool_]:
        """(k,) whether i and j are neighbours."""
        key = i * self.n + j
        place = np.minimum(np.searchsorted(self._key, key), len(self._key) - 1)
        return self._key[place] == key

    def spread(self, nodes: NDArray) -> tuple[NDArray, NDArray]:
        """All pairs of an entry of `nodes`, by its place, and a neighbour of it."""
        count = self.start[nodes + 1] - self.start[nodes]
        place = np.repeat(np.arange(len(nodes)), count)
        offset = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        return place, self.col[self.start[nodes[place]] + offset]


def simplices(graph: Graph, d: int) -> NDArray[np.int64]:
    """(m, d + 1) all cliques of d + 1 nodes, each with its nodes increasing."""
    cliques = np.arange(graph.n)[:, None]
    for _ in range(d):
        place, new = graph.spread(cliques[:, -1])
        later = new > cliques[place, -1]
        place, new = place[later], new[later]
        for k in range(cliques.shape[1] - 1):
            both = graph.coupled(cliques[place, k], new)
            place, new = place[both], new[both]
        cliques = np.column_stack([cliques[place], new])
    return cliques


def boxes(graph: Graph, d: int) -> NDArray[np.int64]:
    """(m, 2**d) cliques of 2**d nodes that are all common neighbours of two of theirs; nodes increasing.

    In a mesh of quadrilaterals or hexahedra opposite corners of a cell share the nodes of that cell and no others.
    """
    corners = 2**d
    first = graph.row < graph.col
    i, j = graph.row[first], graph.col[first]
    place, other = graph.spread(i)
    common = graph.coupled(j[place], other)
    place, other = place[common], other[common]
    full = np.bincount(place, minlength=len(i)) == corners - 2
    kept = full[place]
    others = other[kept].reshape(-1, corners - 2)
    cells = np.unique(np.sort(np.column_stack([i[full], j[full], others]), axis=1), axis=0)
    for a in range(corners):
        for b in range(a + 1, corners):
            cells = cells[graph.coupled(cells[:, a], cells[:, b])]
    return cells


def ordered_boxes(cells: NDArray[np.int64], points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Put the corners of each cell in meshio's order, positively oriented.

    For each choice of d corners as neighbours of the first, the others are predicted as those of a parallelepiped;
    the choice
    whose predictions are nearest to distinct corners wins.
    """
    m, corners = cells.shape
    d = points.shape[1]
    x = _rounded(points[cells])
    x = x - x[:, :1]
    bits = (np.arange(corners)[:, None] >> np.arange(d)) & 1
    best = np.full(m, np.inf)
    order = np.zeros((m, corners), dtype=np.int64)
    for choice in combinations(range(1, corners), d):
        edges = x[:, choice, :]
        predicted = np.einsum("kd,mde->mke", bits, edges)
        distance = np.linalg.norm(predicted[:, :, None, :] - x[:, None, :, :], axis=3)
        nearest = distance.argmin(axis=2)
        distinct = (np.sort(nearest, axis=1) == np.arange(corners)).all(axis=1)
        misfit = np.where(distinct, distance.min(axis=2).sum(axis=1), np.inf)
        better = misfit < best
        best[better], order[better] = misfit[better], nearest[better]
    for odd in np.flatnonzero(~np.isfinite(best)):
        order[odd] = _assigned(x[odd], bits)
    cube = np.take_along_axis(cells, order, axis=1)
    edges = points[cube[:, 1 << np.arange(d)]] - points[cube[:, :1]]
    mirrored = np.linalg.det(edges) < 0
    swapped = cube.copy()
    exchange = ((np.arange(corners) & 1) << 1) | ((np.arange(corners) >> 1) & 1) | (np.arange(corners) & ~3)
    swapped[mirrored] = cube[mirrored][:, exchange]
    ring = [0, 1, 3, 2] if d == 2 else [0, 1, 3, 2, 4, 5, 7, 6]
    return swapped[:, ring]


def _rounded(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners of each cell (m, k, d) after the linear map that makes their covariance the identity: nearly a cube."""
    centred = x - x.mean(axis=1, keepdims=True)
    value, vector = np.linalg.eigh(np.einsum("mka,mkb->mab", centred, centred))
    value = np.maximum(value, 1e-12 * value[:, -1:])
    return np.einsum("mka,mab->mkb", centred, vector / np.sqrt(value)[:, None, :])


def _assigned(x: NDArray[np.float64], bits: NDArray) -> NDArray[np.int64]:
    """The same for one distorted cell (k, d), with the cheapest assignment for each choice."""
    best, order = np.inf, np.arange(len(x))
    for choice in combinations(range(1, len(x)), x.shape[1]):
        distance = np.linalg.norm((bits @ x[list(choice)])[:, None] - x[None], axis=2)
        rows, columns = linear_sum_assignment(distance)
        if distance[rows, columns].sum() < best:
            best, order = distance[rows, columns].sum(), columns
    return order
