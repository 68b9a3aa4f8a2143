"""Candidates for cells: sets of nodes of which each couples to each."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..budget import AT_ONCE
from ..tolerances import ALIKE
from ..topology.keys import contains, runs


class Graph:
    """Neighbours of nodes, with fast answers to "are these two coupled?", from a symmetric pattern (n, n)."""

    def __init__(self, pattern: sp.csr_array):
        coo = pattern.sorted_indices().tocoo()
        off = coo.row != coo.col
        self.n, self.row, self.col = pattern.shape[0], coo.row[off].astype(np.int64), coo.col[off].astype(np.int64)
        self.start = np.searchsorted(self.row, np.arange(self.n + 1))
        self._key = self.row * self.n + self.col

    @classmethod
    def of(cls, n: int, i: NDArray, j: NDArray) -> Graph:
        """The graph of n nodes in which i and j, (k,) each, are neighbours."""
        ends = np.concatenate([i, j]), np.concatenate([j, i])
        return cls(sp.csr_array((np.ones(2 * len(i), np.int8), ends), shape=(n, n)))

    def coupled(self, i: NDArray, j: NDArray) -> NDArray[np.bool_]:
        """(k,) whether i and j are neighbours."""
        return contains(self._key, i * self.n + j)

    def spread(self, nodes: NDArray) -> tuple[NDArray, NDArray]:
        """All pairs of an entry of `nodes`, by its place, and a neighbour of it."""
        place, offset = runs(self.start[nodes + 1] - self.start[nodes])
        return place, self.col[self.start[nodes[place]] + offset]

    @cached_property
    def closed(self) -> sp.csr_array:
        """Pattern of ones, with the diagonal."""
        own = np.arange(self.n)
        row, col = np.concatenate([self.row, own]), np.concatenate([self.col, own])
        return sp.csr_array((np.ones(len(row), np.int32), (row, col)), shape=(self.n, self.n))

    @cached_property
    def common(self) -> NDArray[np.int64]:
        """(e,) how many neighbours two that are coupled have in common, both themselves included; i < j in order."""
        work = np.cumsum(self.closed @ np.diff(self.closed.indptr).astype(np.int64))
        found = [np.empty(0, np.int64)]
        for rows in np.split(np.arange(self.n), np.searchsorted(work, np.arange(AT_ONCE, work[-1:].sum(), AT_ONCE))):
            block = self.closed[rows]
            common = sp.csr_array((block @ self.closed).multiply(block))
            common.sort_indices()
            found.append(common.data[common.indices > np.repeat(rows, np.diff(common.indptr))])
        return np.concatenate(found).astype(np.int64)

    def in_common(self, i: NDArray, j: NDArray, k: int) -> NDArray[np.int64]:
        """(m, k) nodes, increasing, that are next to both of pairs, (m,) each, these included; there are as many."""
        both = sp.csr_array(self.closed[i].multiply(self.closed[j]))
        both.sort_indices()
        return both.indices.reshape(-1, k).astype(np.int64)

    def cliques(self, sets: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(m,) whether all nodes of each of the sets (m, k) are coupled to each other."""
        good = np.ones(len(sets), dtype=bool)
        for a in range(sets.shape[1]):
            for b in range(a + 1, sets.shape[1]):
                good[good] = self.coupled(sets[good, a], sets[good, b])
        return good


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


def shared_cliques(graph: Graph, k: int) -> NDArray[np.int64]:
    """(m, k) cliques of k nodes that are all that two of them have in common; nodes increasing.

    A node couples to the nodes of the cells around it. So nodes on opposite sides of a cell, like opposite corners of
    a box or the middles of opposite edges of a quadratic tetrahedron, share the nodes of that cell and no others; a
    node inside a cell has no others itself.
    """
    upper = graph.row < graph.col
    i, j = graph.row[upper][graph.common == k], graph.col[upper][graph.common == k]
    found = np.empty((0, k), np.int64)
    for some in np.array_split(np.arange(len(i)), 1 + len(i) * k * k // AT_ONCE):
        found = np.unique(np.vstack([found, graph.in_common(i[some], j[some], k)]), axis=0)
    return found[graph.cliques(found)]


def straight_simplices(graph: Graph, points: NDArray[np.float64]) -> NDArray[np.int64]:
    """(m, 6 or 10) corners and middles of simplices whose sides have a node in the middle; nodes increasing.

    In quadratic triangles of one material the entries between a corner and the middle of the side facing it vanish, so
    that the six nodes are no clique; but all middles are coupled.
    """
    d = points.shape[1]
    known = np.flatnonzero(np.isfinite(points).all(axis=1))
    first = (graph.row < graph.col) & np.isin(graph.row, known) & np.isin(graph.col, known)
    i, j = graph.row[first], graph.col[first]
    length = np.linalg.norm(points[i] - points[j], axis=1)
    away, nearest = cKDTree(points[known]).query((points[i] + points[j]) / 2)
    middle = known[nearest]
    side = (away < ALIKE * length) & graph.coupled(i, middle) & graph.coupled(j, middle)
    i, j, middle = i[side], j[side], middle[side]
    corners = simplices(Graph.of(graph.n, i, j), d)
    key = i * graph.n + j  # increasing, as the graph's rows are
    a, b = np.triu_indices(d + 1, 1)
    middles = middle[np.searchsorted(key, corners[:, a] * graph.n + corners[:, b])]
    whole = graph.cliques(middles)
    return np.sort(np.column_stack([corners[whole], middles[whole]]), axis=1)
