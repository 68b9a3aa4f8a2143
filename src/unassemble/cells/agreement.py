"""Numbers that several places have in common: each by itself may be a coincidence."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..topology.keys import distinct

SAME_SCALE = 1e-6
"""Relative difference of factors c that count as one."""

SCALE_ERROR = 1e5
"""Relative error of c in small pieces, over that of the entries, at most."""

_LEAST = 2  # places that must agree


def common_values(value: NDArray[np.float64], place: NDArray[np.int64], agree: float) -> NDArray[np.float64]:
    """Values that several places share, the most frequent first.

    Parameters
    ----------
    value : (k,) float64
        Of one sign.
    place : (k,) int64
        Where each was found; a place counts once for each value.
    agree : float
        Relative difference of neighbours, in increasing order, that count as the same value.
    """
    if not len(value):
        return np.empty(0)
    order = np.argsort(value)
    value, place = value[order], place[order]
    run = np.cumsum(np.append(0, np.abs(np.diff(value)) > agree * np.abs(value[1:])))
    count = np.bincount(distinct(run * (int(place.max()) + 1) + place) // (int(place.max()) + 1))
    best = np.argsort(-count, kind="stable")
    best = best[count[best] >= _LEAST]
    size = np.bincount(run)
    start = np.cumsum(size) - size
    lower, upper = (value[(start + step // 2)[best]] for step in (size - 1, size))
    return np.asarray(0.5 * (lower + upper))  # medians
