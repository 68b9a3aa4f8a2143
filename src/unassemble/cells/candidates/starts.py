"""Readings to begin with, as the angles suggest them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .angles import FULL, facing_angles, largest_sum
from .candidates import Candidates
from .choosing import chosen
from .strain import eased, strain

_INNER = (-0.35 * np.pi, -0.55 * np.pi)  # angle excess above which a vertex may be an inner one


def likely_readings(candidates: Candidates) -> Iterator[NDArray[np.bool_]]:
    """Readings to begin with, the likeliest first."""
    long = ~candidates.corner & ~candidates.half & ~candidates.crossed & ~candidates.outer & (candidates.size > 3)
    sums = (2 - candidates.belief) * np.pi  # those of holes are larger than pi
    by_angles = long & (sums < largest_sum(sums[long]))
    inner = [candidates.corner & (candidates.belief > 0.5 + excess / np.pi) for excess in _INNER]
    faces = (candidates.first, candidates.triangles | by_angles)
    none = np.zeros_like(candidates.corner)
    corners = [*inner, *(some & ~candidates.strip for some in (*inner, candidates.corner & (candidates.belief == 1.0)))]
    corners += [some | candidates.half for some in (*corners, none)] if candidates.half.any() else []
    tried = {(some | more).tobytes(): some | more for some in faces for more in (*corners, none)}
    seen: set[bytes] = set()
    for likely in sorted(tried.values(), key=lambda labels: strain(candidates, labels)):
        labels = chosen(candidates, np.where(likely, 1 + candidates.belief, -np.inf))
        if labels.any() and labels.tobytes() not in seen:
            first = not seen
            seen.add(labels.tobytes())
            yield labels
            relieved = eased(candidates, labels) if first else None
            if relieved is not None:
                seen.add(relieved.tobytes())
                yield relieved


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
