"""Triangles of which many are holes, wherever these lie: labels relaxed from a mesh without any.

Nearly every edge between two triangles is one equation, and a planar mesh has three edges to every two coordinates: so
even where nothing but the weights tells holes from cells there are more conditions than holes, unless these are very
many. That is the case for labels between 0 and 1 (:mod:`unassemble.cells.relax.relaxation`), which need no good start
as long as what is certain is left as it is: a triangle with a side of its own is a cell. What pieces then fit by
themselves, with an equation to spare, is kept, and the rest is relaxed again.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..candidates.candidates import Candidates
from ..judge.labelling import Labelling, sound_pieces
from .relaxation import Path, relaxed
from .sheet import Sheet

_PATHS = (
    Path(mapped_above=1e-3, outlier=0.3),
    Path(mapped_above=1e-3, outlier=1.0, slack=0.1),
    Path(outlier=1.0),
)
_DONE = 0.01
"""Mean misfit at the end of a path after which no other one is tried."""
_ROUNDS = 6  # of relaxing what does not fit by itself
_SPARE = 2  # edges to each vertex, with which a mesh has far more equations than unknowns

Descend = Callable[[Labelling[Candidates], NDArray[np.bool_]], Labelling[Candidates]]


def with_holes(candidates: Candidates, state: NDArray[np.int8], descend: Descend) -> Labelling[Candidates] | None:
    """The triangles that fit best; None where some edge lies on no triangle, or there are too few equations.

    Parameters
    ----------
    candidates : Candidates
    state : (m,) int8
        1 for known cells among its triangles, -1 for known holes, else 0.
    descend : callable
        Puts the last wrong labels right, of those (cells,) bool that are free.
    """
    sides, e = candidates.triangle_sides, len(candidates.edges)
    count = np.bincount(sides.ravel(), minlength=e)
    if e <= _SPARE * candidates.n_vertices or candidates.weights[count == 0].any():
        return None
    number, best = np.flatnonzero(candidates.triangles), None
    settled = (state != 0) | (count == 1)[sides].any(axis=1)
    is_cell = state >= 0
    for _ in range(_ROUNDS):
        cells, free = np.zeros((2, candidates.count), dtype=bool)
        cells[number], free[number] = is_cell | ~settled, ~settled
        labelling = descend(_relaxed(candidates, cells, free), free)
        if best is None or labelling.mean_misfit < best.mean_misfit:
            best = labelling
        sound = ~settled & _sound(labelling)[sides].any(axis=1)
        if best.fits or not sound.any():
            break
        settled |= sound
        is_cell[sound] = labelling.labels[number[sound]]
    return best


def _sound(labelling: Labelling) -> NDArray[np.bool_]:
    """(e,) edges of pieces that fit by themselves: triangles at these are what they are taken for."""
    sound = np.zeros(len(labelling.edges), dtype=bool)
    for piece, _ in sound_pieces(zip(labelling.pieces, labelling.meshes, strict=True), labelling.misfit):
        sound[piece.edge_rows] = True
    return sound


def _relaxed(candidates: Candidates, cells: NDArray[np.bool_], free: NDArray[np.bool_]) -> Labelling[Candidates]:
    """The best at the ends of paths that begin with cells everywhere; until one leads near enough."""
    best = Labelling.of(candidates, cells)
    sheet = Sheet(candidates, candidates.scale or candidates.judged_by, cells)
    for path in _PATHS:
        with np.errstate(all="ignore"):  # a given scale may be out of all proportion
            labels = relaxed(sheet, free[cells], path)
        if labels is not None:
            end = Labelling.of(candidates, labels)
            best = end if end.mean_misfit < best.mean_misfit else best
        if best.mean_misfit <= _DONE:
            break
    return best
