"""How far positions may be off where entries are rounded: by what other rounding does to them.

Entries as far off as rounding may have left them are drawn anew, and positions are found from these as from those given
(a parametric bootstrap; Efron and Tibshirani, An Introduction to the Bootstrap, 1993, chapter 6). So errors that
cancel do, and those that a weak equation magnifies are seen where it does.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import REDRAWN
from ..errors import GeometryError
from ..tolerances import SIGMAS
from .nodal import determined
from .rounded import Rounding


def known_to(
    points: NDArray[np.float64],
    component: NDArray[np.int64],
    rounding: Rounding,
    place: Callable[[sp.csr_array], NDArray[np.float64]],
    *,
    sized: bool,
) -> float:
    """Largest error of a node, relative to the diameter of its piece; infinite where a node may get lost.

    Parameters
    ----------
    points : (n, d) float64
        NaN where not determined.
    component : (n,) int64
        Piece of each node, -1 where not determined.
    rounding : Rounding
    place : callable
        Such points from a matrix that may have been rounded to the given one.
    sized : bool
        Whether the matrix tells size and sign.
    """
    pieces = [np.flatnonzero(component == one) for one in range(component.max(initial=-1) + 1)]
    moved = np.zeros(len(points))
    try:
        for seed in range(REDRAWN):
            other = place(rounding.redrawn(seed))
            if not determined(other)[component >= 0].all():
                return float("inf")
            for piece in pieces:
                moved[piece] += _moved(points[piece], other[piece], sized=sized)
    except GeometryError:
        return float("inf")
    return SIGMAS * float(np.sqrt(moved.max(initial=0.0) / REDRAWN))


def _moved(x: NDArray[np.float64], y: NDArray[np.float64], *, sized: bool) -> NDArray[np.float64]:
    """(n,) squared distances of points from others, in the same place, relative to their diameter."""
    x, y = x - x.mean(axis=0), y - y.mean(axis=0)
    factor = 1.0 if sized else (x * y).sum() / (y * y).sum()
    return np.asarray(np.square(x - factor * y).sum(axis=1) / np.square(np.ptp(x, axis=0)).sum())
