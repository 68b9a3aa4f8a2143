"""Triangles of which many are holes, wherever these lie: labels relaxed from a mesh without any.

Nearly every edge between two triangles is one equation, and a planar mesh has three edges to every two coordinates: so
even where nothing but the weights tells holes from cells there are more conditions than holes, unless these are very
many. That is the case for labels between 0 and 1 (:mod:`unassemble.cells.relax.relaxation`), which need no good start
as long as what is certain is left as it is: a triangle with a side of its own is a cell.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..candidates.candidates import Candidates
from .relaxation import relaxed
from .sheet import Sheet

_SPARE = 2  # edges to each vertex, with which a mesh has far more equations than unknowns


def with_holes(candidates: Candidates, state: NDArray[np.int8]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]] | None:
    """Labels of the triangles, and which of them may be wrong.

    None where some edge lies on no triangle, there are too few equations, or no conformal map.

    `state` (m,): 1 for known cells among its triangles, -1 for known holes, else 0.
    """
    sides, e = candidates.triangle_sides, len(candidates.edges)
    count = np.bincount(sides.ravel(), minlength=e)
    if e <= _SPARE * candidates.n_vertices or candidates.weights[count == 0].any():
        return None
    number = np.flatnonzero(candidates.triangles)
    cells, free = np.zeros((2, candidates.count), dtype=bool)
    cells[number] = state >= 0
    free[number] = (state == 0) & ~(count == 1)[sides].any(axis=1)
    sheet = Sheet(candidates, candidates.scale or candidates.judged_by, cells)
    with np.errstate(all="ignore"):  # a given scale may be out of all proportion
        labels = relaxed(sheet, free[cells])
    return None if labels is None else (labels, free)
