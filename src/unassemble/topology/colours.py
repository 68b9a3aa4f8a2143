"""Vertices of a weighted graph told apart by what they see: colour refinement (Weisfeiler and Leman 1968).

Vertices of one colour see the same weights towards the same colours. Where that leaves several of a colour, one of them
can be told apart, and refinement goes on.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

EQUAL = 1e-9
"""Relative difference of weights that are equal but for rounding."""

_ZERO = 1e-14  # difference, relative to the largest weight, that is none
_SEED, _STEP = np.uint64(0x9E3779B97F4A7C15), (np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB))


def kinds_of(weights: NDArray, equal: float = EQUAL) -> NDArray[np.int64]:
    """0, 1, ... for each weight by its rank, the same for those next to each other that are equal but for so much."""
    weights = weights if weights.sum() >= 0 else -weights
    order = np.argsort(weights)
    size = np.abs(weights)
    new = np.diff(weights[order], prepend=-np.inf) > np.maximum(equal * size[order], _ZERO * size.max(initial=0.0))
    kinds = np.empty(len(weights), dtype=np.int64)
    kinds[order] = np.cumsum(new) - 1
    return kinds


class Colours:
    """Colours 0, 1, ... of the vertices of one graph.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
    kinds : (e,) int64
        Of the weights, see :func:`kinds_of`.
    """

    def __init__(self, n: int, edges: NDArray, kinds: NDArray[np.int64]):
        tail, head = np.concatenate([edges, edges[:, ::-1]]).T
        order = np.argsort(tail, kind="stable")
        self._n = n
        self._tail, self._head = tail[order], head[order]
        self._kind = np.tile(kinds, 2)[order]
        self.kinds = kinds

    def of_twins(self) -> NDArray[np.int64]:
        """Rank of each vertex among those with the same neighbours and weights, which any order suits."""
        seen = self.seen(np.arange(self._n))
        order = np.argsort(seen, kind="stable")
        first = np.flatnonzero(np.append(True, seen[order][1:] != seen[order][:-1]))
        rank = np.empty(self._n, dtype=np.int64)
        rank[order] = np.arange(self._n) - np.repeat(first, np.diff(np.append(first, self._n)))
        return rank

    def refined(self, colour: NDArray, rounds: int | None = None) -> NDArray[np.int64]:
        """Colours split until vertices of one colour see the same, or for so many rounds."""
        count = 0
        for done in itertools.count(1):
            seen = self.seen(colour)
            order = np.lexsort((seen, colour))
            new = np.append(True, (np.diff(colour[order]) != 0) | (seen[order][1:] != seen[order][:-1]))
            colour = np.empty_like(colour)
            colour[order] = np.cumsum(new) - 1
            if new.sum() == count or done == rounds:
                break
            count = int(new.sum())
        return colour

    def discrete(self, colour: NDArray) -> NDArray[np.int64]:
        """Refined until no two vertices have the same colour, one vertex after the other told apart."""
        while True:
            colour = self.refined(colour)
            several = np.flatnonzero(np.bincount(colour) > 1)
            if not len(several):
                return colour
            colour = apart(colour, int(np.argmax(colour == several[0])))

    def seen(self, colour: NDArray) -> NDArray[np.uint64]:
        """A number for the weights and colours about each vertex."""
        total = np.zeros(self._n, dtype=np.uint64)
        np.add.at(
            total, self._tail, _mixed(_mixed(self._kind.astype(np.uint64)) + colour[self._head].astype(np.uint64))
        )
        return total


def apart(colour: NDArray, vertex: int) -> NDArray[np.int64]:
    """One vertex before all others of its colour."""
    doubled = 2 * colour
    doubled[vertex] -= 1
    return doubled - doubled.min()


def _mixed(value: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Scrambled 64-bit integers (the finaliser of SplitMix64; Steele, Lea and Flood 2014)."""
    value = value + _SEED
    value = (value ^ (value >> np.uint64(30))) * _STEP[0]
    value = (value ^ (value >> np.uint64(27))) * _STEP[1]
    return value ^ (value >> np.uint64(31))
