"""Labels between 0 and 1: many wrong ones put right at once.

There are more candidates than conditions, and many fractional labels explain the matrix. As wrong labels are few, the
least change in the sense of sum_k |s_k - s0_k| is sought, subject to the weights: linearised at the right mesh, this
linear program has whole labels as its solution. Positions are not known yet, so they and the labels are improved
together, along the central path of a logarithmic barrier t:

    minimise  sum_k |s_k - s0_k| - t sum_k log s_k (1 - s_k) + 1/(2 q) |r - J d - g w - B ds|^2,

one Newton step for each t, q falling with t. The path commits itself to whole labels as late as possible.
"""

import numpy as np
from numpy.typing import NDArray

from ...errors import RecoveryError
from ..candidates.candidates import Candidates
from .sheet import Sheet

_FIRST, _LAST, _FACTOR = 0.3, 1e-3, 0.75
"""Barriers t, and the ratio of one to the one before."""


def with_holes(candidates: Candidates, state: NDArray[np.int8]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]] | None:
    """Labels of triangles of which many are holes, relaxed from a mesh without any, and which of them may be wrong.

    Nearly every edge between two triangles is one equation, and a planar mesh has three edges to every two coordinates:
    so there are more conditions than holes, unless these are very many. Labels between 0 and 1 then need no good start
    as long as what is certain is left as it is: a triangle with a side of its own is a cell.

    None where some edge lies on no triangle, there are too few equations, no conformal map on the way, or no step.

    `state` (m,): 1 for known cells among its triangles, -1 for known holes, else 0.
    """
    sides, e = candidates.triangle_sides, len(candidates.edges)
    count = np.bincount(sides.ravel(), minlength=e)
    if e <= 2 * candidates.n_vertices or candidates.weights[count == 0].any():
        return None
    number = np.flatnonzero(candidates.triangles)
    cells, free = np.zeros((2, candidates.count), dtype=bool)
    cells[number] = state >= 0
    free[number] = (state == 0) & ~(count == 1)[sides].any(axis=1)
    given = np.flatnonzero(candidates.weights)[0]
    judged_by = float(candidates.weights[given] / candidates.relative[given])  # the c that angles are
    sheet = Sheet(candidates, candidates.scale or judged_by, cells)
    strength, t, placed = np.where(cells, np.where(free, 0.95, 1.0), 0.0), _FIRST, None
    try:
        with np.errstate(all="ignore"):  # a given scale may be out of all proportion
            while t > _LAST:
                placed = sheet.mapped(strength, placed)
                s, slack = strength[free], 0.03 * t / _FIRST
                # Larger misfits than 0.3 count themselves, not by their squares.
                trust = np.minimum(0.3 / np.abs(sheet.misfit(placed, strength)), 1.0) / slack
                held = 1e-9 / slack + t / s**2 + t / (1 - s) ** 2
                pull = 1.0 + t / s - t / (1 - s)  # labels are drawn to 1
                moved = s + sheet.label_step(placed, strength, np.flatnonzero(free), trust, held, pull)
                strength[free] = np.clip(moved, 0.1 * s, 1 - 0.1 * (1 - s))  # not all of the way to 0 or 1
                t *= _FACTOR
    except RecoveryError:
        return None
    return strength > 0.5, free
