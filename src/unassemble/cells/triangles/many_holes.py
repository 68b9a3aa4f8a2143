"""Triangles of which many are holes, wherever these lie: labels relaxed from a mesh without any.

Nearly every edge between two triangles is one equation, and a planar mesh has three edges to every two coordinates: so
even where nothing but the weights tells holes from cells there are more conditions than holes, unless these are very
many. That is the case for labels between 0 and 1 (:mod:`unassemble.cells.labels.relaxation`), which need no good
start as long as what is certain is left as it is: a triangle with a side of its own is a cell, and what follows from it
where c is known. The few labels that the path leaves wrong are put right by small changes.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from ...errors import RecoveryError
from ...planar.piece import PieceMesh
from ...topology import Piece
from ...topology.cycles import three_cycles
from ...topology.embedding import face_complexes
from ..candidates.candidates import Candidates
from ..labels.descent import Descent, better
from ..labels.effort import Effort
from ..labels.fitting import Fitted, fitted
from ..labels.mending import MOST_VERTICES
from ..labels.relaxation import Aim, HopelessError, Path, central_path
from ..labels.sheet import Sheet
from ..reading import FITS, Reading
from .peeling import ContradictionError, peeled, scales_of_lone_triangles
from .triangles_only import covered

_PATHS = (
    Path(mapped_above=1e-3, outlier=0.3),
    Path(mapped_above=1e-3, outlier=1.0, slack=0.1),
    Path(outlier=1.0),
)
_FIRST = 0.95  # strength of triangles that may be holes
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
    best = _read(candidates, scale)
    c = scale or _scale_of_sound_pieces(best) or next(iter(scales_of_lone_triangles(opposite, weights)), None)
    if not best.fits and c:
        best = better(best, _read(Candidates.of(drawing, weights, c), c, peel=True))
    return best if best.fits else None


def _read(candidates: Candidates, c: float | None, *, peel: bool = False) -> Reading:
    """The best reading that paths lead to; what fits by itself is kept, and the rest relaxed again."""
    cells = candidates.first & (candidates.size == 3)
    cell, half = candidates.sides.T
    sides, number = half[cells[cell]].reshape(-1, 3) >> 1, np.flatnonzero(cells)
    own = np.bincount(sides.ravel(), minlength=len(candidates.edges)) == 1
    state = own[sides].any(axis=1).astype(np.int8)
    if peel and c:
        with suppress(ContradictionError):  # in a drawing where some cell is no face
            state = peeled(sides, 2 * candidates.weights / c).state
    best: Reading = Reading.unsolved(candidates, cells)
    for _ in range(_ROUNDS):
        cells[number] = state >= 0
        free = np.zeros_like(cells)
        free[number] = state == 0
        sheet = Sheet(candidates, c or candidates.judged_by, cells.copy())
        end = _relaxed(sheet, free)
        reading = Reading.of(candidates, cells if end is None else end.labels)
        reading = Descent(reading, free=free).run(Effort(_SOLVES))
        best = better(best, reading)
        settled = (state == 0) & _sound(reading)[sides].any(axis=1)
        if best.fits or not settled.any():
            break
        state[settled] = np.where(reading.labels[number[settled]], 1, -1)
    return best


def _sound_pieces(reading: Reading) -> Iterator[tuple[Piece, PieceMesh]]:
    """Pieces that fit by themselves, which is no chance."""
    for piece, mesh in zip(reading.pieces, reading.meshes, strict=True):
        if mesh is not None and piece.redundancy > 0 and (reading.misfit[piece.edge_rows] <= FITS).all():
            yield piece, mesh


def _sound(reading: Reading) -> NDArray[np.bool_]:
    """(e,) edges of such pieces: triangles at these are what they are taken for."""
    sound = np.zeros(len(reading.edges), dtype=bool)
    for piece, _ in _sound_pieces(reading):
        sound[piece.edge_rows] = True
    return sound


def _scale_of_sound_pieces(reading: Reading) -> float | None:
    """The c of the largest of these, if there are any."""
    return max(((piece.n_vertices, mesh.scale) for piece, mesh in _sound_pieces(reading)), default=(0, None))[1]


def _relaxed(sheet: Sheet, free: NDArray[np.bool_]) -> Fitted | None:
    """The best whole labels at the ends of paths that begin with cells everywhere; until one leads near enough."""
    aim = Aim(np.ones(int(sheet.chosen.sum())), np.where(free[sheet.chosen], 1.0, np.inf))
    found: list[Fitted] = []
    for path in _PATHS:
        strength = np.where(free, _FIRST, sheet.chosen.astype(np.float64))
        # A given scale may be out of all proportion.
        with suppress(RecoveryError, HopelessError), np.errstate(all="ignore"):
            strength, placed = central_path(sheet, aim, strength, None, path)
            found.append(fitted(sheet, strength > 0.5, placed))
            if found[-1].cost <= _DONE * len(sheet.edges):
                break
    return min(found, key=lambda fit: fit.cost, default=None)
