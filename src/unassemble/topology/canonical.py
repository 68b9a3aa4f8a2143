"""A numbering of a small weighted graph that does not depend on the one it comes in.

Vertices are told apart by colour refinement: those of one colour see the same weights towards the same colours. Where
that leaves several of a colour, one of them is told apart and refinement goes on. Of the first such choice all are
tried, and the numbering with the least edge list is taken; later ones are nearly always the same but for a symmetry.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .numbering import Numbering, local_numbering

LARGEST = 1000
"""Vertices above which the breadth-first numbering must do."""
_MOST_TRIED = 60
_EQUAL = 1e-9  # relative difference of weights that are equal but for rounding
_ZERO = 1e-14  # and one, relative to the largest, that is none
_SEED, _STEP = np.uint64(0x9E3779B97F4A7C15), (np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB))


def settled_numbering(n: int, edges: NDArray, weights: NDArray) -> Numbering:
    """The same for the same weighted graph, in whatever order its vertices come; breadth-first on large graphs.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
        Pairs i < j in lexicographic order.
    weights : (e,) float64
        What is equal but for rounding counts as equal. Neither size nor sign of all together matters.
    """
    if n > LARGEST:
        return local_numbering(n, edges)
    kinds = _kinds(weights)
    colours = _Colours(n, edges, kinds)
    first = colours.refined(colours.of_twins())
    several = np.flatnonzero(np.bincount(first) > 1)
    if not len(several):
        return _numbering(edges, first)
    chosen = np.flatnonzero(first == several[0])[:_MOST_TRIED]
    numberings = [_numbering(edges, colours.discrete(_apart(first, vertex))) for vertex in chosen.tolist()]
    return min(numberings, key=lambda found: (found.edges.tolist(), kinds[found.edge_rows].tolist()))


def _kinds(weights: NDArray) -> NDArray[np.int64]:
    """0, 1, ... for each weight by its rank, the same for equal ones."""
    weights = weights if weights.sum() >= 0 else -weights
    order = np.argsort(weights)
    size = np.abs(weights)
    new = np.diff(weights[order], prepend=-np.inf) > np.maximum(_EQUAL * size[order], _ZERO * size.max(initial=0.0))
    kinds = np.empty(len(weights), dtype=np.int64)
    kinds[order] = np.cumsum(new) - 1
    return kinds


class _Colours:
    """Colours 0, 1, ... of the vertices of one graph."""

    def __init__(self, n: int, edges: NDArray, kinds: NDArray[np.int64]):
        tail, head = np.concatenate([edges, edges[:, ::-1]]).T
        order = np.argsort(tail, kind="stable")
        self._n = n
        self._tail, self._head = tail[order], head[order]
        self._kind = np.tile(kinds, 2)[order]

    def of_twins(self) -> NDArray[np.int64]:
        """Rank of each vertex among those with the same neighbours and weights, which any order suits."""
        seen = self._seen(np.arange(self._n))
        order = np.argsort(seen, kind="stable")
        first = np.flatnonzero(np.append(True, seen[order][1:] != seen[order][:-1]))
        rank = np.empty(self._n, dtype=np.int64)
        rank[order] = np.arange(self._n) - np.repeat(first, np.diff(np.append(first, self._n)))
        return rank

    def refined(self, colour: NDArray) -> NDArray[np.int64]:
        """Colours split until vertices of one colour see the same."""
        count = 0
        while True:
            seen = self._seen(colour)
            order = np.lexsort((seen, colour))
            new = np.append(True, (np.diff(colour[order]) != 0) | (seen[order][1:] != seen[order][:-1]))
            colour = np.empty_like(colour)
            colour[order] = np.cumsum(new) - 1
            if new.sum() == count:
                return colour
            count = int(new.sum())

    def discrete(self, colour: NDArray) -> NDArray[np.int64]:
        """Refined until no two vertices have the same colour, one vertex after the other told apart."""
        while True:
            colour = self.refined(colour)
            several = np.flatnonzero(np.bincount(colour) > 1)
            if not len(several):
                return colour
            colour = _apart(colour, int(np.argmax(colour == several[0])))

    def _seen(self, colour: NDArray) -> NDArray[np.uint64]:
        """A number for the weights and colours about each vertex."""
        total = np.zeros(self._n, dtype=np.uint64)
        np.add.at(
            total, self._tail, _mixed(_mixed(self._kind.astype(np.uint64)) + colour[self._head].astype(np.uint64))
        )
        return total


def _apart(colour: NDArray, vertex: int) -> NDArray[np.int64]:
    """One vertex before all others of its colour."""
    doubled = 2 * colour
    doubled[vertex] -= 1
    return doubled - doubled.min()


def _numbering(edges: NDArray, number: NDArray) -> Numbering:
    ends = np.sort(number[edges], axis=1)
    rows = np.lexsort(ends.T[::-1])
    return Numbering(np.argsort(number), rows, ends[rows])


def _mixed(value: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Scrambled 64-bit integers (the finaliser of SplitMix64; Steele, Lea and Flood 2014)."""
    value = value + _SEED
    value = (value ^ (value >> np.uint64(30))) * _STEP[0]
    value = (value ^ (value >> np.uint64(27))) * _STEP[1]
    return value ^ (value >> np.uint64(31))
