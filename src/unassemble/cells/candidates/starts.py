"""Readings to begin with, as the angles suggest them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .angles import FULL, facing_angles, largest_sum
from .candidates import Candidates
from .choosing import chosen

_LEFT_OUT = 0.05  # squared excess of an angle sum, in units of pi, above which a short face may be left out
_INNER = (-0.35 * np.pi, -0.55 * np.pi)  # angle excess above which a vertex may be an inner one


def likely_readings(candidates: Candidates) -> Iterator[NDArray[np.bool_]]:
    """Readings to begin with, the likeliest first."""
    long = ~candidates.corner & ~candidates.half & ~candidates.crossed & ~candidates.outer & (candidates.size > 3)
    sums = (2 - candidates.belief) * np.pi  # those of holes are larger than pi
    by_angles = long & (sums < largest_sum(sums[long]))
    inner = [candidates.corner & (candidates.belief > 0.5 + excess / np.pi) for excess in _INNER]
    faces = (candidates.first, (candidates.first & (candidates.size == 3)) | by_angles)
    none = np.zeros_like(candidates.corner)
    corners = [*inner, *(some & ~candidates.strip for some in (*inner, candidates.corner & (candidates.belief == 1.0)))]
    corners += [some | candidates.half for some in (*corners, none)] if candidates.half.any() else []
    tried = {(some | more).tobytes(): some | more for some in faces for more in (*corners, none)}
    seen = set()
    for likely in sorted(tried.values(), key=lambda labels: strain(candidates, labels)):
        labels = chosen(candidates, np.where(likely, 1 + candidates.belief, -np.inf))
        if labels.any() and labels.tobytes() not in seen:
            seen.add(labels.tobytes())
            yield labels


def tilings(candidates: Candidates) -> Iterator[NDArray[np.bool_]]:
    """Faces by their angles where no others are cells, so that sides between both have all of their weight.

    All faces but the outer ones, then the longer ones only where these border every edge: in tilings all that lie
    between them may be holes.
    """
    inner = ~candidates.corner & ~candidates.half & ~candidates.crossed & ~candidates.outer
    for least in (0, *np.unique(candidates.size[inner])[1:].tolist()):
        longer = inner & (candidates.size >= least)
        cell, half = candidates.sides[longer[candidates.sides[:, 0]]].T
        used = np.zeros(2 * len(candidates.edges), dtype=bool)
        used[half] = True
        if least and not used.reshape(-1, 2).any(axis=1).all():
            break
        angle = facing_angles(candidates.relative[half >> 1] * np.where(used[half ^ 1], 1, 2))
        likely = longer & ((candidates.size == 3) | (np.bincount(cell, angle, candidates.count) < FULL))
        yield chosen(candidates, np.where(likely, 1.0, -np.inf))


def strain(candidates: Candidates, labels: NDArray[np.bool_]) -> float:
    """How far the angles of some cells are from adding up to pi, edges between two of them shared equally.

    Short faces left out add a little, or no cells would be best.
    """
    cell, half = candidates.sides[labels[candidates.sides[:, 0]]].T
    used = np.zeros(2 * len(candidates.edges), dtype=bool)
    used[half] = True
    facing = facing_angles(candidates.relative[half >> 1] * np.where(used[half ^ 1], 1, 2))
    angles = np.bincount(cell, facing, candidates.count)
    # A corner has a right angle, and two others, the mean of what its sides show; half circles see one as well.
    sides = np.maximum(np.bincount(cell, minlength=candidates.count), 1)
    unseen = np.pi / 2 * (candidates.corner | candidates.half)
    sums = np.where(candidates.corner, 2 * angles / sides, angles) + unseen
    return float(((sums[labels] / np.pi - 1) ** 2).sum()) + _LEFT_OUT * float((candidates.first & ~labels).sum())
