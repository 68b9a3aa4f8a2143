"""Triangles of which many are holes, wherever these lie: labels relaxed from a mesh without any.

Nearly every edge between two triangles is one equation, and a planar mesh has three edges to every two coordinates: so
even where nothing but the weights tells holes from cells there are more conditions than holes, unless these are very
many. That is the case for labels between 0 and 1 (:mod:`unassemble.cells.labels.relaxation`), which need no good
start as long as what is certain is left as it is: a triangle with a side of its own is a cell, and what follows from it
where c is known. The few labels that the path leaves wrong are put right by small changes.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from ...topology.cycles import three_cycles
from ...topology.embedding import face_complexes
from ..candidates.candidates import Candidates
from ..labels.descent import Descent, better
from ..labels.effort import Effort
from ..labels.fitting import Fitted
from ..labels.mending import MOST_VERTICES, relaxed
from ..labels.relaxation import Aim, HopelessError, Path
from ..labels.sheet import Sheet
from ..reading import Reading, sound_pieces
from .peeling import ContradictionError, peeled, scales_of_lone_triangles
from .triangles_only import covered

_PATHS = (
    Path(mapped_above=1e-3, outlier=0.3),
    Path(mapped_above=1e-3, outlier=1.0, slack=0.1),
    Path(outlier=1.0),
)
_DONE = 0.002  # mean cost of an edge at the end of a path after which no other one is tried
_SOLVES = 150  # for small changes
_ROUNDS = 6  # of relaxing what does not fit by itself
_SPARE = 2  # edges to each vertex, with which a mesh has far more equations than unknowns


def read_with_holes(n: int, edges: NDArray, weights: NDArray, scale: float | None) -> Reading | None:
    """Triangles that fit; None where none are found, or some edge lies on no triangle.

    Parameters are those of :func:`unassemble.cells.search.read_cells`.
    """
    if n > MOST_VERTICES or len(edges) <= _SPARE * n:
        return None
    _, opposite = three_cycles(n, edges)
    if not covered(opposite, weights):
        return None
    drawing = next(face_complexes(n, edges), None)
    if drawing is None:
        return None
    candidates = Candidates.of(drawing, weights, scale)
    best = _read(candidates, _with_own_sides(candidates))
    c = scale or _scale_of_sound_pieces(best) or next(iter(scales_of_lone_triangles(opposite, weights)), None)
    if not best.fits and c:
        candidates = Candidates.of(drawing, weights, c)
        try:
            state = peeled(candidates.triangle_sides, 2 * weights / c).state
        except ContradictionError:  # in a drawing where some cell is no face
            state = _with_own_sides(candidates)
        best = better(best, _read(candidates, state))
    return best if best.fits else None


def _with_own_sides(candidates: Candidates) -> NDArray[np.int8]:
    """(m,) 1 for triangles with a side on no other one, which are cells; 0 for the others."""
    sides = candidates.triangle_sides
    own = np.bincount(sides.ravel(), minlength=len(candidates.edges)) == 1
    return own[sides].any(axis=1).astype(np.int8)


def _read(candidates: Candidates, state: NDArray[np.int8]) -> Reading:
    """The best reading that paths lead to; what fits by itself is kept, and the rest relaxed again.

    Parameters
    ----------
    candidates : Candidates
    state : (m,) int8
        1 for known cells among the triangles, -1 for known holes, else 0.
    """
    number, sides = np.flatnonzero(candidates.triangles), candidates.triangle_sides
    unit, best = candidates.scale or candidates.judged_by, None
    for _ in range(_ROUNDS):
        cells, free = np.zeros((2, candidates.count), dtype=bool)
        cells[number], free[number] = state >= 0, state == 0
        end = _relaxed(Sheet(candidates, unit, cells), free[cells])
        reading = Reading.of(candidates, cells if end is None else end.labels)
        reading = Descent(reading, free=free).run(Effort(_SOLVES))
        best = better(best, reading)
        settled = (state == 0) & _sound(reading)[sides].any(axis=1)
        if best.fits or not settled.any():
            break
        state = np.where(settled, np.where(reading.labels[number], 1, -1), state)
    assert best is not None
    return best


def _sound(reading: Reading) -> NDArray[np.bool_]:
    """(e,) edges of pieces that fit by themselves: triangles at these are what they are taken for."""
    sound = np.zeros(len(reading.edges), dtype=bool)
    for piece, _ in sound_pieces(zip(reading.pieces, reading.meshes, strict=True), reading.misfit):
        sound[piece.edge_rows] = True
    return sound


def _scale_of_sound_pieces(reading: Reading) -> float | None:
    """The c of the largest of these, if there are any."""
    sound = sound_pieces(zip(reading.pieces, reading.meshes, strict=True), reading.misfit)
    return max(((piece.n_vertices, mesh.scale) for piece, mesh in sound), default=(0, None))[1]


def _relaxed(sheet: Sheet, free: NDArray[np.bool_]) -> Fitted | None:
    """The best whole labels at the ends of paths that begin with cells everywhere; until one leads near enough."""
    aim = Aim(np.ones(len(free)), np.where(free, 1.0, np.inf))
    found: list[Fitted] = []
    for path in _PATHS:
        # A given scale may be out of all proportion.
        with suppress(HopelessError), np.errstate(all="ignore"):
            fit = relaxed(sheet, aim, path)
            found += [fit] if fit else []
        if found and found[-1].cost <= _DONE * len(sheet.edges):
            break
    return min(found, key=lambda fit: fit.cost, default=None)
