"""What a search for cells begins with in each drawing of a graph."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from numpy.typing import NDArray

from ..planar.piece import PieceMesh
from ..topology.embedding import drawing_with_corners, face_complexes
from .candidates.candidates import FEW, Candidates
from .candidates.crosses import Crosses
from .candidates.starts import likely_readings, tilings
from .labels.descent import Descent
from .labels.effort import SMALL_GRAPH, Effort
from .labels.evidence import entries_are_to_blame
from .labels.mending import MOST_VERTICES
from .labels.repairs import leapt, repaired
from .misfits.spoilt import without_wrong_entries
from .reading import Reading
from .small_changes import CLOSE, QUICK, best_of, widened

A_FEW = 24
"""Solves for small changes of a reading that stands, should none help."""

_STARTS = 2  # readings that are worth repairing
_SOON = 0.3  # part of the effort that a first repair of starts with few wrong labels may take


@dataclass(frozen=True)
class Begun:
    """What one drawing begins with.

    Attributes
    ----------
    starts : list of Reading
        Worth repairing, the best first.
    likeliest : Reading or None
        What the angles suggest, where that makes planar surfaces.
    settled : bool
        Whether the first start is the answer: it fits, or none will.
    spoilt : Reading or None
        The answer if no reading fits: with entries set aside as wrong, others having small errors.
    """

    starts: list[Reading]
    likeliest: Reading | None = None
    settled: bool = False
    spoilt: Reading | None = None

    @cached_property
    def descents(self) -> list[Descent]:
        """A search for small changes from each start."""
        seen: set[bytes] = set()
        return [Descent(start, seen=seen) for start in self.starts]


def drawings(
    n: int,
    edges: NDArray,
    weights: NDArray,
    scale: float | None,
    errors: NDArray | None,
    guess: float | None = None,
    *,
    wide: bool = False,
) -> Iterator[Candidates]:
    """What may be cells in each drawing; first in one about the vertices that their numbers make crosses."""
    if n <= MOST_VERTICES:
        crosses = Crosses.of(n, edges, weights, scale, errors)
        drawing = drawing_with_corners(n, edges, crosses.wedges) if crosses.unique.any() else None
        if drawing is not None:
            yield Candidates.of(drawing, weights, scale, crosses, guess, errors, wide)
    for drawing in face_complexes(n, edges):
        yield Candidates.of(drawing, weights, scale, None, guess, errors, wide)


def begun(candidates: Candidates, effort: Effort, turns: int) -> Begun:
    """Starts in one drawing, at no more than so many solves for turning its parts over."""
    starts = []
    for labels in likely_readings(candidates):
        starts.append(effort.reading(candidates, labels))
        if starts[-1].fits:
            return Begun(starts[-1:], settled=True)
    if starts and candidates.n_vertices <= MOST_VERTICES and (tiling := _tiling(candidates, effort)) is not None:
        return Begun([tiling], settled=True)
    nearest = min(starts, key=lambda reading: reading.size, default=None)
    if nearest is not None and nearest.size < CLOSE and nearest.candidates.n_vertices > SMALL_GRAPH:
        leap = leapt(nearest, Effort(A_FEW, effort.known))
        if leap.fits:
            return Begun([leap], settled=True)
        if leap is not nearest:  # or it would be repaired twice
            starts.append(leap)
        nearest = leap
    # Of a reading of triangles alone, all there are, this has been asked before.
    spoilt = None if nearest is None or _all_triangles(nearest) else without_wrong_entries(nearest)
    if nearest is not None and spoilt is not None:
        if nearest.candidates.n_vertices <= SMALL_GRAPH:  # one wrong corner may look like a wrong entry
            nearest = _turned_over(nearest, Effort(A_FEW, effort.known), A_FEW)
            nearest = nearest if nearest.fits else Descent(nearest).run(Effort(A_FEW, effort.known))
        if nearest.fits or spoilt.fits_but_for_few:
            return Begun([nearest if nearest.fits else spoilt], settled=True)
    if starts and entries_are_to_blame(starts[0]):
        return Begun(starts[:1], settled=True)
    likeliest = next((start for start in starts if start.pieces), None)
    starts = sorted(starts, key=lambda reading: reading.size)[:_STARTS]
    for start in starts:
        if start.size > CLOSE:
            break
        if candidates.n_vertices < FEW:  # a few changes cost next to nothing
            nearest = best_of(start, map(Descent, (start, widened(start))), QUICK)
            if nearest.fits:
                return Begun([nearest], settled=True)
        soon = repaired(start, Effort(int(_SOON * effort.solves), effort.known))
        if not soon.fits and candidates.n_vertices > SMALL_GRAPH:
            soon = Descent(soon).run(Effort(A_FEW, effort.known))
        if soon.fits:
            return Begun([soon], settled=True)
    for k, start in enumerate(starts):
        starts[k] = _turned_over(start, effort, turns // len(starts))
        if starts[k].fits:
            return Begun([starts[k]], settled=True)
    return Begun(starts, likeliest, spoilt=spoilt)


def _tiling(candidates: Candidates, effort: Effort) -> Reading | None:
    """A reading that fits as it is, with sides along holes or another c supposed; these solves are not counted."""
    either = [candidates]
    guess = candidates.other_scale() if candidates.scale is None else None
    if guess is not None:
        either.append(candidates.drawn(candidates.drawing, guess))
    for one in either:
        for labels in tilings(one):
            reading = Reading.of(one, labels, effort.known)
            if reading.fits:
                return reading
    return None


def _all_triangles(reading: Reading) -> bool:
    """Whether the 3-cycles, all of them, are the cells."""
    candidates = reading.candidates
    return bool((reading.labels == candidates.triangles).all())


def _turned_over(reading: Reading, effort: Effort, solves: int) -> Reading:
    """Parts of the drawing turned over, each because that lowers the misfit; at no more than so many solves."""
    least = effort.solves - solves
    trials = reading.candidates.turned(reading.labels)
    while reading.pieces and not reading.fits and effort.solves > least and (labels := next(trials, None)) is not None:
        trial = effort.reading(reading.candidates, labels)
        if trial.size < 0.999 * reading.size:
            reading, trials = trial, trial.candidates.turned(trial.labels)
    return reading


def fitting_starts(
    n: int, edges: NDArray, weights: NDArray, scale: float | None = None, errors: NDArray | None = None
) -> Iterator[Reading]:
    """All readings to begin with that fit as they are, in all drawings.

    Parameters are those of :func:`unassemble.cells.search.read_cells`.
    """
    known: dict[bytes, PieceMesh | None] = {}
    for candidates in drawings(n, edges, weights, scale, errors):
        for labels in likely_readings(candidates):
            reading = Reading.of(candidates, labels, known)
            if reading.fits:
                yield reading


def first_reading(n: int, edges: NDArray, weights: NDArray) -> Reading | None:
    """What the angles suggest, without positions: the first choice of cells that makes planar surfaces."""
    for drawing in face_complexes(n, edges):
        candidates = Candidates.of(drawing, weights)
        for labels in likely_readings(candidates):
            reading = Reading.unsolved(candidates, labels)
            if reading.pieces:
                return reading
    return None
