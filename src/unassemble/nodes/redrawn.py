"""How far positions may be off where entries are rounded: by what other rounding does to them.

Entries as far off as rounding may have left them are drawn anew, and positions are found from these as from those given
(a parametric bootstrap; Efron and Tibshirani, An Introduction to the Bootstrap, 1993, chapter 6). So errors that
cancel do, and those that a weak equation magnifies are seen where it does.

That holds if rounding is all that entries are off by: the misfits that they leave then are as large as the changes that
drawing anew brings to them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.stats
from numpy.typing import NDArray

from ..budget import REDRAWN
from ..errors import GeometryError
from ..tolerances import CONFIDENCE, LAST_DIGITS, NOISY, SIGMAS
from .nodal import determined
from .rounded import Rounding


@dataclass(frozen=True)
class Known:
    """How well positions are known."""

    error: float  # largest of a node, relative to the diameter of its piece; infinite where one may get lost
    explained: bool = True  # whether rounding explains the misfits, so that the error is all that there is


def known_to(
    points: NDArray[np.float64],
    component: NDArray[np.int64],
    misfits: NDArray[np.float64],
    rounding: Rounding,
    place: Callable[[sp.csr_array], tuple[NDArray[np.float64], NDArray[np.float64]]],
    *,
    sized: bool,
) -> Known:
    """Find positions anew, with other rounding.

    `place` finds points and their misfits (m,) from a matrix that may have been rounded to the given one; `sized` says
    whether the matrix tells size and sign.
    """
    pieces = [np.flatnonzero(component == one) for one in range(component.max(initial=-1) + 1)]
    moved, changes = np.zeros(len(points)), np.zeros((REDRAWN, len(misfits)))
    try:
        for seed in range(REDRAWN):
            other, left = place(rounding.redrawn(seed))
            if not determined(other)[component >= 0].all() or len(left) != len(misfits):
                return Known(float("inf"))
            for piece in pieces:  # in the same place, relative to the diameter
                x, y = (one[piece] - one[piece].mean(axis=0) for one in (points, other))
                factor = 1.0 if sized else (x * y).sum() / (y * y).sum()
                moved[piece] += np.square(x - factor * y).sum(axis=1) / np.square(np.ptp(x, axis=0)).sum()
            mirrored = not sized and np.nansum(points * other) < 0
            changes[seed] = (-left if mirrored else left) - misfits
    except GeometryError:
        return Known(float("inf"))
    return Known(SIGMAS * float(np.sqrt(moved.max(initial=0.0) / REDRAWN)), _explained(misfits, changes))


def _explained(misfits: NDArray[np.float64], changes: NDArray[np.float64]) -> bool:
    """Whether misfits (m,) are no larger than changes (k, m) of them, by an F test, or as arithmetic leaves them.

    Misfits depend on each other: that of few degrees of freedom shows by changes that are alike or opposite.
    """
    if (np.abs(misfits) <= LAST_DIGITS).all():  # as in regular meshes, whatever the numbers are
        return True
    products, draws = changes @ changes.T, len(changes)
    size = np.trace(products) / draws
    if not size > 0:
        return False
    alike = (np.square(products).sum() - np.square(products.diagonal()).sum()) / (draws * (draws - 1))
    freedom = max(1.0, size**2 / alike)
    bound = scipy.stats.f.isf(CONFIDENCE, freedom, draws * freedom)
    return bool(misfits @ misfits <= size * max(NOISY**2, bound))
