"""Sets of candidates that are labellings: no half-edge in two cells, no edge in none."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .candidates import Candidates


def chosen(candidates: Candidates, value: NDArray, fallback: NDArray | None = None) -> NDArray[np.bool_]:
    """(cells,) compatible candidates of finite value, and others for edges that border none of these.

    The others are those of the highest `fallback` value, by default those believed in most.
    """
    return covering(candidates, compatible(candidates, value), candidates.belief if fallback is None else fallback)


def compatible(candidates: Candidates, value: NDArray) -> NDArray[np.bool_]:
    """(cells,) candidates of finite value, none of which loses to a better one that wants the same half-edge.

    Rounds of local maxima: a candidate is taken if it beats all rivals that are still in play.
    """
    if not candidates.count:
        return np.zeros(0, dtype=bool)
    cell, start = candidates.conflicts[0][:, 0], candidates.conflicts[1]
    rank = np.empty(candidates.count, dtype=np.int64)
    # Ties in random order: in the order of numbers they would be settled one by one along a boundary.
    ties = np.random.default_rng(0).permutation(candidates.count)
    rank[np.lexsort((ties, value))] = np.arange(candidates.count)
    rank[~np.isfinite(value)] = -1
    taken = np.zeros(candidates.count, dtype=bool)
    run = np.repeat(np.arange(len(start) - 1), np.diff(start))
    while (rank >= 0).any():
        best = np.maximum.reduceat(rank[cell], start[:-1])
        beaten = np.zeros(candidates.count, dtype=bool)
        beaten[cell[rank[cell] < best[run]]] = True
        winners = (rank >= 0) & ~beaten
        taken |= winners
        lost = np.zeros(len(start) - 1, dtype=bool)
        lost[run[winners[cell]]] = True
        rank[cell[lost[run]]] = -1
    return taken


def covering(candidates: Candidates, labels: NDArray[np.bool_], value: NDArray) -> NDArray[np.bool_]:
    """The same labels with further candidates, the most valued ones, for edges that border no cell.

    A nonzero weight is the cotangent of some angle: every edge borders a cell.
    """
    labels = labels.copy()
    cell, half = candidates.sides.T
    while True:
        used = np.zeros(2 * len(candidates.edges), dtype=bool)
        used[half[labels[cell]]] = True
        bare = (candidates.weights != 0) & ~used.reshape(-1, 2).any(axis=1)
        blocked = np.zeros(candidates.count, dtype=bool)
        blocked[cell[used[half]]] = True
        wanted = np.zeros(candidates.count, dtype=bool)
        wanted[cell[bare[half >> 1]]] = True
        wanted &= ~blocked & ~labels
        if not wanted.any():
            return labels
        order = np.lexsort((-value[cell], half >> 1))
        order = order[wanted[cell[order]] & bare[half[order] >> 1]]
        best = order[np.flatnonzero(np.diff(half[order] >> 1, prepend=-1))]
        chosen = np.zeros(candidates.count, dtype=bool)
        chosen[cell[best]] = True
        labels |= compatible(candidates, np.where(chosen, value, -np.inf))
