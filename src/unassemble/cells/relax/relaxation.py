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
from ...planar.piece import PieceMesh
from ..candidates.candidates import Candidates
from .sheet import Sheet

_FIRST, _LAST, _FACTOR = 0.3, 1e-3, 0.75
"""Barriers t, and the ratio of one to the one before."""


def relaxed(sheet: Sheet, free: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """Whole labels at the end of a path that begins with all chosen candidates as cells.

    `free` (k,): which of the chosen candidates may be holes; the others are known cells.

    Returns (cells,), None where there is no conformal map on the way, or an equation is singular.
    """
    strength = np.zeros(sheet.candidates.count)
    strength[sheet.chosen] = np.where(free, 0.95, 1.0)
    changing, t, placed = np.flatnonzero(sheet.chosen)[free], _FIRST, None
    try:
        while t > _LAST:
            placed = sheet.mapped(strength, placed)
            strength[changing] = _step(sheet, placed, strength, changing, t)
            t *= _FACTOR
    except RecoveryError:
        return None
    return strength > 0.5


def _step(sheet: Sheet, placed: PieceMesh, strength: NDArray, changing: NDArray, t: float) -> NDArray[np.float64]:
    """New strengths of the candidates that may change."""
    s, slack = strength[changing], 0.03 * t / _FIRST
    with np.errstate(divide="ignore"):  # larger misfits than 0.3 count themselves, not by their squares
        trust = np.minimum(0.3 / np.abs(sheet.misfit(placed, strength)), 1.0) / slack
    held = 1e-9 / slack + t / s**2 + t / (1 - s) ** 2
    pull = 1.0 + t / s - t / (1 - s)  # labels are drawn to 1
    moved = s + sheet.label_step(placed, strength, changing, trust, held, pull)
    return np.clip(moved, 0.1 * s, 1 - 0.1 * (1 - s))  # not all of the way to 0 or 1


def with_holes(candidates: Candidates, state: NDArray[np.int8]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]] | None:
    """Labels of triangles of which many are holes, relaxed from a mesh without any, and which of them may be wrong.

    Nearly every edge between two triangles is one equation, and a planar mesh has three edges to every two coordinates:
    so there are more conditions than holes, unless these are very many. Labels between 0 and 1 then need no good start
    as long as what is certain is left as it is: a triangle with a side of its own is a cell.

    None where some edge lies on no triangle, there are too few equations, or no conformal map.

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
    sheet = Sheet(candidates, candidates.scale or candidates.judged_by, cells)
    with np.errstate(all="ignore"):  # a given scale may be out of all proportion
        labels = relaxed(sheet, free[cells])
    return None if labels is None else (labels, free)
