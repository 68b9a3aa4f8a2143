"""Permutations of the vertices of a weighted graph that change no weight.

Vertices that colour refinement tells from all others stay where they are under every such permutation. What is left
falls apart into regions, mostly small ones; where the vertices of one are told apart in two ways alike, the one who
takes the place of the other is a permutation to try (McKay's search for automorphisms, without backtracking: it finds
nearly all, and each is checked).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from .canonical import LARGEST
from .colours import Colours, apart, kinds_of
from .keys import Grouped, pair_keys

_ROUNDS = 12  # of refinement on larger graphs
_MOST_TRIED = 60  # vertices of a region that take the place of others


def symmetries(
    n: int, edges: NDArray, weights: NDArray, agree: float
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Generators of the symmetries, as far as they move no more than 1,000 vertices.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
        Pairs i < j in lexicographic order.
    weights : (e,) float64
    agree : float
        Relative difference of weights that count as equal.

    Yields
    ------
    rows, images : (k,) int64
        Vertices that are moved, and where to.
    """
    if not len(edges):
        return
    symmetry = _Check(n, edges, weights, agree)
    colours = Colours(n, edges, kinds_of(weights, agree))
    ranks = colours.of_twins()
    for rows in _twins(colours, ranks):
        if symmetry.holds(rows, rows[::-1]):
            yield rows, rows[::-1]
    colour = colours.refined(ranks, None if n <= LARGEST else _ROUNDS)
    region, count = _regions(n, edges, colour)
    vertices = Grouped(region, count)
    inner = Grouped(np.where(region[edges[:, 0]] == region[edges[:, 1]], region[edges[:, 0]], -1), count)
    for k in range(count):
        rows = vertices.order[vertices.start[k] : vertices.start[k + 1]]
        own = inner.order[inner.start[k] : inner.start[k + 1]]
        part = Colours(len(rows), vertices.rank[edges[own]], colours.kinds[own])
        for images in _exchanged(part, colour[rows]):
            moved = images != np.arange(len(rows))
            if symmetry.holds(rows[moved], rows[images[moved]]):
                yield rows[moved], rows[images[moved]]


def _twins(colours: Colours, ranks: NDArray[np.int64]) -> NDArray[np.int64]:
    """(k, 2) vertices next to each other among those with the same neighbours and weights."""
    if not ranks.any():
        return np.empty((0, 2), np.int64)
    seen = colours.seen(np.arange(len(ranks)))
    order = np.lexsort((ranks, seen))
    return np.column_stack([order[:-1], order[1:]])[ranks[order[1:]] > 0]


def _regions(n: int, edges: NDArray, colour: NDArray[np.int64]) -> tuple[NDArray[np.int64], int]:
    """(n,) labels of vertices of ambiguous colour that hang together, and how many there are.

    Those of the same colours have the same label; -1 for all other vertices, and for those of too large regions.
    """
    several = np.bincount(colour)[colour] > 1
    inner = edges[several[edges].all(axis=1)]
    graph = sp.coo_array((np.ones(len(inner), np.int8), inner.T), shape=(n, n))
    label = csgraph.connected_components(graph, directed=False)[1]
    rows = np.flatnonzero(several)
    shared = sp.coo_array((np.ones(len(rows), np.int8), (label[rows], n + colour[rows])), shape=(2 * n, 2 * n))
    region = csgraph.connected_components(shared, directed=False)[1][label[rows]]
    small = np.bincount(region)[region] <= LARGEST if len(rows) else several[rows]
    labels = np.full(n, -1)
    names, labels[rows[small]] = np.unique(region[small], return_inverse=True)
    return labels, len(names)


def _exchanged(part: Colours, colour: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """Permutations that take one vertex to the place of another, those found before staying where they are."""
    tried = 0
    while True:
        colour = part.refined(colour)
        several = np.flatnonzero(np.bincount(colour) > 1)
        if not len(several):
            return
        first, *others = np.flatnonzero(colour == several[0]).tolist()
        from_first = np.argsort(part.discrete(apart(colour, first)))
        for other in others:
            if tried == _MOST_TRIED:
                return
            tried += 1
            images = np.empty_like(from_first)
            images[from_first] = np.argsort(part.discrete(apart(colour, other)))
            yield images
        colour = apart(colour, first)


class _Check:
    """Whether permutations of few vertices change no weight."""

    def __init__(self, n: int, edges: NDArray, weights: NDArray, agree: float):
        self._n, self._agree = n, agree
        ends, numbers = np.concatenate([edges, edges[:, ::-1]]), np.tile(np.arange(len(edges)), 2)
        order = np.argsort(ends[:, 0], kind="stable")
        self._incident = numbers[order]
        self._start = np.searchsorted(ends[order, 0], np.arange(n + 1))
        self._edges, self._weights = edges, weights
        self._keys = edges[:, 0] * n + edges[:, 1]

    def holds(self, rows: NDArray[np.int64], images: NDArray[np.int64]) -> bool:
        """Whether all edges of the rows are edges of the images, of the same weights."""
        if not len(rows):
            return False
        place = [self._incident[self._start[row] : self._start[row + 1]] for row in rows.tolist()]
        near = np.unique(np.concatenate(place))
        where = dict(zip(rows.tolist(), images.tolist(), strict=True))
        ends = np.array([where.get(end, end) for end in self._edges[near].ravel().tolist()]).reshape(-1, 2)
        keys = pair_keys(self._n, *ends.T)
        found = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        before, after = self._weights[near], self._weights[found]
        close = np.abs(after - before) <= self._agree * np.maximum(np.abs(before), np.abs(after))
        return bool((self._keys[found] == keys).all() and close.all())
