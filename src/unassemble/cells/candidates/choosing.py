"""Sets of candidates that are labellings, no half-edge in two cells and no edge in none; those to begin with."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .angles import facing_angles
from .candidates import Candidates


def chosen(candidates: Candidates, value: NDArray, fallback: NDArray | None = None) -> NDArray[np.bool_]:
    """(cells,) compatible candidates of finite value, and others for edges that border none of these.

    A nonzero weight is the cotangent of some angle: every edge borders a cell. The others are those of the highest
    `fallback` value, by default those believed in most.
    """
    labels = compatible(candidates, value)
    value = candidates.belief if fallback is None else fallback
    cell, half = candidates.sides.T
    while True:
        used = np.zeros(2 * len(candidates.edges), dtype=bool)
        used[half[labels[cell]]] = True
        bare = (candidates.weights != 0) & ~used.reshape(-1, 2).any(axis=1)
        wanted = np.zeros(candidates.count, dtype=bool)
        wanted[cell[bare[half >> 1]]] = True
        wanted[cell[used[half]]] = False
        wanted &= ~labels
        if not wanted.any():
            return labels
        order = np.lexsort((-value[cell], half >> 1))
        order = order[wanted[cell[order]] & bare[half[order] >> 1]]
        best = np.zeros(candidates.count, dtype=bool)
        best[cell[order[np.flatnonzero(np.diff(half[order] >> 1, prepend=-1))]]] = True
        labels = labels | compatible(candidates, np.where(best, value, -np.inf))


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


_INNER = (-0.35 * np.pi, -0.55 * np.pi)
"""Angle excess above which a vertex may be an inner one."""
_LEFT_OUT = 0.05
"""Squared excess of an angle sum, in units of pi, above which a short face may be left out."""


def likely_labels(candidates: Candidates) -> Iterator[NDArray[np.bool_]]:
    """(cells,) labels to begin with, the likeliest first."""
    long = ~candidates.corner & ~candidates.outer & (candidates.cells.size > 3)
    by_angles = long & (candidates.belief > 0.7)  # angles that add up to less than 1.3 pi
    corners = [candidates.corner & (candidates.belief > 0.5 + excess / np.pi) for excess in _INNER]
    corners.append(np.zeros_like(candidates.corner))
    faces = (candidates.first, candidates.triangles | by_angles)
    tried = {(some | more).tobytes(): some | more for some in faces for more in corners}
    seen: set[bytes] = set()
    for likely in sorted(tried.values(), key=lambda labels: strain(candidates, labels)):
        labels = chosen(candidates, np.where(likely, 1 + candidates.belief, -np.inf))
        if labels.any() and labels.tobytes() not in seen:
            seen.add(labels.tobytes())
            yield labels


def strain(candidates: Candidates, labels: NDArray[np.bool_]) -> float:
    """How far the angles of some cells are from adding up to pi, edges between two of them shared equally.

    Squares of the excess in units of pi. A corner has a right angle and two others, the mean of what its sides show.
    Short faces left out add a little, or no cells would be best.
    """
    cell, half = candidates.sides[labels[candidates.sides[:, 0]]].T
    used = np.zeros(2 * len(candidates.edges), dtype=bool)
    used[half] = True
    facing = facing_angles(candidates.relative[half >> 1] * np.where(used[half ^ 1], 1, 2))
    angles = np.bincount(cell, facing, candidates.count)[labels]
    sides = np.bincount(cell, minlength=candidates.count)[labels]
    corner = candidates.corner[labels]
    sums = np.where(corner, 2 * angles / sides + np.pi / 2, angles)
    return float(((sums / np.pi - 1) ** 2).sum()) + _LEFT_OUT * float((candidates.first & ~labels).sum())
