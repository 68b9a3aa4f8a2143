"""Labellings to begin with, as the angles suggest them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .angles import facing_angles, largest_sum
from .candidates import Candidates
from .choosing import chosen

_INNER = (-0.35 * np.pi, -0.55 * np.pi)
"""Angle excess above which a vertex may be an inner one."""
_LEFT_OUT = 0.05
"""Squared excess of an angle sum, in units of pi, above which a short face may be left out."""


def likely_labels(candidates: Candidates) -> Iterator[NDArray[np.bool_]]:
    """(cells,) labels to begin with, the likeliest first."""
    long = ~candidates.corner & ~candidates.outer & (candidates.size > 3)
    sums = (2 - candidates.belief) * np.pi  # those of holes are larger than pi
    by_angles = long & (sums < largest_sum(sums[long]))
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
