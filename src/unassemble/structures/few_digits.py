"""How far positions may be off where entries are rounded: by what other rounding does to them.

Entries as far off as rounding may have left them are drawn anew, and positions are found from these as from those given
(a parametric bootstrap; Efron and Tibshirani, An Introduction to the Bootstrap, 1993, chapter 6). So errors that
cancel do, and those that a weak equation magnifies are seen where it does.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from ..budget import REDRAWN
from ..errors import GeometryError
from ..nodes.rounded import Rounding
from ..tolerances import SIGMAS
from .placed import Placed


def known_to(found: Placed, exact: sp.csr_array, rounding: Rounding, place: Callable[[sp.csr_array], Placed]) -> float:
    """Largest error of a node, relative to the diameter of what is placed; infinite where a node may get lost.

    Parameters
    ----------
    found : Placed
    exact : (N, N) sparse
        The matrix, whose sums are exact; see :func:`.rounded.with_exact_sums`.
    rounding : Rounding
    place : callable
        Positions from another such matrix.
    """
    moved = np.zeros(len(found.points))
    try:
        for seed in range(REDRAWN):
            other = place(rounding.redrawn(exact, seed)).points
            moved += np.square(other - found.points).sum(axis=1)
    except GeometryError:
        return float("inf")
    placed = found.component >= 0
    diameter = float(np.linalg.norm(np.ptp(found.points[placed], axis=0)))
    off = float(np.sqrt(moved[placed].max() / REDRAWN))
    return SIGMAS * off / diameter if off < diameter else float("inf")
