"""From a planar graph and its numbers to the cells that fit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ..planar.piece import PieceMesh
from ..topology.embedding import drawing_with_corners, face_complexes
from .candidates.candidates import FEW, Candidates
from .candidates.cell_set import CellSet
from .candidates.crosses import Crosses
from .candidates.turned_over import with_a_part_turned_over, with_less_strain
from .covers.covering import MOST_EQUAL_CELLS, read_by_cover
from .labels.descent import Descent, better
from .labels.effort import SMALL_GRAPH, Effort
from .labels.evidence import entries_are_to_blame
from .labels.mending import MOST_VERTICES, mended
from .labels.relaxation import HopelessError
from .labels.repairs import repaired
from .misfits.spoilt import without_wrong_entries
from .reading import Reading
from .triangles.drawings import read_in_drawings
from .triangles.triangles_only import read_triangles

_STARTS = 2  # readings to begin with that are worth repairing
_DRAWINGS = 3  # that a graph may have, about
_QUICK = 36  # solves for small changes of a start, those of three readings
_SOME = 60  # the same of a reading that is nearly right, or the nearest when all else has failed
_TURNING = 0.5  # part of them for turning parts over, in all drawings that are begun with
_FIRST = 0.7  # part of them for the likeliest reading
_MOST_ROUNDS, _LIKELIEST = (
    4,
    3,
)  # parts turned over in a reading one after the other, and how many of them are gone on with
_EQUAL = 1e-9  # relative difference of weights that are all the same
_A_FEW = 24  # solves for small changes of a reading that stands, should none help
_FEW_TURNS = 8  # solves for turning parts over in each drawing of such a graph
_CLOSE, _SOON = 0.15, 0.3  # misfit of starts with few wrong labels, and what part of them a first repair may take more


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


def read_cells(
    n: int, edges: NDArray, weights: NDArray, scale: float | None = None, errors: NDArray | None = None
) -> Reading | None:
    """The reading of a connected planar graph that fits its weights, or else the one that fits best.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
        Pairs i < j in lexicographic order; at least one.
    weights : (e,) float64
        -A_ij of each edge.
    scale : float, optional
        c, where it is known.
    errors : (e,) float64, optional
        Standard deviations of the errors of the weights, where they are known.

    Returns
    -------
    Reading or None
        None if no reading makes a planar surface.
    """
    if np.ptp(weights) <= _EQUAL * np.abs(weights).max():
        return _of_equal_weights(n, edges, weights, scale, errors)
    effort = Effort.for_graph(n)
    triangles = read_triangles(n, edges, weights, scale, effort)
    if triangles is None:
        triangles = read_in_drawings(n, edges, weights, scale, errors)
    if triangles is not None:
        return triangles
    best, spoilt = _searched(n, edges, weights, scale, errors, effort)
    if best is not None and n < FEW and best.size < _CLOSE and not (best.fits or best.like_noise):
        best = _among_all(best, n, edges, weights, scale, errors)
    if best is None or not best.pieces:
        return spoilt
    if spoilt is None or best.fits or best.fits_but_for_few or best.like_noise:
        return best
    return spoilt


def _searched(
    n: int,
    edges: NDArray,
    weights: NDArray,
    scale: float | None,
    errors: NDArray | None,
    effort: Effort,
    guess: float | None = None,
    *,
    wide: bool = False,
) -> tuple[Reading | None, Reading | None]:
    """The best reading, and the one with entries set aside as wrong that stands where none fits."""
    best: Reading | None = None
    spoilt: Reading | None = None
    together = n <= SMALL_GRAPH
    turning = _TURNING / (_DRAWINGS if together else 1)
    drawings = _drawings(n, edges, weights, scale, errors, guess, wide=wide)
    cover = cache(partial(read_by_cover, n, edges, weights, scale, errors))
    begun: list[Begun] = []
    done = False
    # Repairs take most of the effort: small graphs are begun with in all drawings before.
    for some in [drawings] if together else ([drawing] for drawing in drawings):
        begun.clear()
        for drawing in some:
            begun.append(_begun(drawing, effort, int(turning * effort.solves)))
            if begun[-1].settled:
                return _settled(best, begun[-1].starts[0]), spoilt
            spoilt = spoilt or begun[-1].spoilt
        for one in begun:
            best, done = _carried_on(best, one, effort, cover)
            if done:
                break
        if done:
            break
    best = _at_last(best, begun if together else [])
    return (_redrawn(best, effort) if best is not None and together else best), spoilt


def _among_all(
    best: Reading, n: int, edges: NDArray, weights: NDArray, scale: float | None, errors: NDArray | None
) -> Reading:
    """The best of a reading that is nearly right and of what searches among all candidates come to.

    Angles are judged by its c, which is better than a first guess, and then by such a guess again: where either leads
    to depends on little things.
    """
    for guess in (best.scale, None):
        again, _ = _searched(n, edges, weights, scale, errors, Effort.for_graph(n), guess, wide=True)
        best = best if again is None else better(best, again)
        if best.fits or scale is not None:
            break
    return best


def _of_equal_weights(
    n: int, edges: NDArray, weights: NDArray, scale: float | None, errors: NDArray | None
) -> Reading | None:
    """A reading that fits of a graph whose weights are all the same, or the best of those to begin with.

    They give the misfit no place to lead to: what is not read at once, or by a cover, most likely is a graph's
    Laplacian, and belongs to no mesh.
    """
    effort, best = Effort.for_graph(n), None
    for drawing in _drawings(n, edges, weights, scale, errors):
        begun = _begun(drawing, effort, _FEW_TURNS)
        for start in begun.starts:
            best = better(best, start)
        if best is not None and best.fits:
            return best
    return read_by_cover(n, edges, weights, scale, errors, most_cells=MOST_EQUAL_CELLS) or (
        Descent(best).run(Effort(_A_FEW, effort.known)) if best is not None and best.pieces else None
    )


def _settled(best: Reading | None, first: Reading) -> Reading:
    """The answer of a drawing whose first start settles it."""
    return first if first.fits or first.fits_but_for_few else better(best, first)


def _carried_on(
    best: Reading | None, begun: Begun, effort: Effort, cover: Callable[[], Reading[CellSet] | None]
) -> tuple[Reading | None, bool]:
    """The best reading after repairs in one drawing, or else by a `cover`, in no drawing; and whether that is the end.

    It is if it fits, or if the weights are found to belong to no mesh: drawings differ little in that.
    """
    before, hopeless = best, False
    try:
        best = _finished(best, begun, effort)
    except HopelessError:  # from afar; a few wrong labels may have bent the map
        best, hopeless = better(best, begun.starts[0]), True
    if best is not None and best.fits:
        return best, True
    if best is not None and best.like_noise:  # or wrong in cells that leave little
        return cover() or best, True
    if best is not None and best is not before and best.size < _CLOSE:  # covers take longer than a few small changes
        best = Descent(best).run(Effort(_SOME, effort.known))
        if best.fits:
            return best, True
    covered = cover()
    if covered is not None:
        return covered, True
    return (best if best is not None and best.pieces else None), hopeless


def _at_last(best: Reading | None, begun: list[Begun]) -> Reading | None:
    """The best of what small changes make of the best reading and, on small graphs, of all starts, if none fits.

    If that is nearly right, the same among more candidates.
    """
    if best is None or not best.pieces or best.fits or best.like_noise:
        return best if best is not None and best.pieces else None
    searches = [search for one in begun for search in one.descents if best.candidates.n_vertices < FEW]
    best = _best_of(best, searches, _QUICK)
    nearest = sorted(searches, key=lambda search: search.least)[:1]
    if all(search.best is not best for search in nearest):
        nearest.append(Descent(best))
    best = best if best.fits else _best_of(best, nearest, _SOME)
    if best.size > _CLOSE or best.fits or not isinstance(best.candidates, Candidates):
        return best
    return _best_of(best, [Descent(_widened(best))], _SOME)


def _redrawn(best: Reading, effort: Effort) -> Reading:
    """A reading, or, if it is nearly right, what small changes make of it with parts turned over, or of new starts."""
    if best.fits or best.size > _CLOSE or not isinstance(best.candidates, Candidates):
        return best
    best = _with_parts_turned_over(best, effort)
    if best.fits:
        return best
    candidates = with_less_strain(best.candidates)
    if candidates is None:
        return best
    share = Effort(_SOME, effort.known)
    begun = _begun(candidates, share, _FEW_TURNS)
    if begun.settled:
        return _settled(best, begun.starts[0])
    return _best_of(best, begun.descents, _SOME)


def _with_parts_turned_over(best: Reading[Candidates], effort: Effort) -> Reading[Candidates]:
    """What small changes make of a reading with parts of its drawing turned over, one after the other."""
    for _ in range(_MOST_ROUNDS):
        before = best
        trials = [
            Reading.of(*turned, effort.known)
            for turned in with_a_part_turned_over(best.candidates, best.labels, best.scale)
        ]
        trials = sorted(trials, key=lambda trial: trial.mean_misfit)[:_LIKELIEST]
        best = _best_of(best, map(Descent, trials), _QUICK)
        if best is before or best.fits:
            break
    return best


def _best_of(best: Reading, searches: Iterable[Descent], solves: int) -> Reading:
    """The best that any search comes to with so many solves, or a former one."""
    for search in searches:
        best = better(best, search.run(Effort(solves)))
        if best.fits:
            break
    return best


def _drawings(
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


def _begun(candidates: Candidates, effort: Effort, turns: int) -> Begun:
    """Starts in one drawing, at no more than so many solves for turning its parts over."""
    starts = []
    for labels in candidates.starts():
        starts.append(effort.reading(candidates, labels))
        if starts[-1].fits:
            return Begun(starts[-1:], settled=True)
    if starts and candidates.n_vertices <= MOST_VERTICES and (tiling := _tiling(candidates, effort)) is not None:
        return Begun([tiling], settled=True)
    # Of a reading of triangles alone, all there are, this has been asked before.
    spoilt = without_wrong_entries(starts[0]) if starts and not _all_triangles(starts[0]) else None
    if spoilt is not None:
        nearest = starts[0]
        if nearest.candidates.n_vertices <= SMALL_GRAPH:  # one wrong corner may look like a wrong entry
            nearest = Descent(nearest).run(Effort(_A_FEW, effort.known))
        if nearest.fits or spoilt.fits_but_for_few:
            return Begun([nearest if nearest.fits else spoilt], settled=True)
    if starts and entries_are_to_blame(starts[0]):
        return Begun(starts[:1], settled=True)
    likeliest = next((start for start in starts if start.pieces), None)
    starts = sorted(starts, key=lambda reading: reading.size)[:_STARTS]
    for start in starts:
        if start.size > _CLOSE:
            break
        if candidates.n_vertices < FEW:  # a few changes cost next to nothing
            nearest = _best_of(start, map(Descent, (start, _widened(start))), _QUICK)
            if nearest.fits:
                return Begun([nearest], settled=True)
        soon = repaired(start, Effort(int(_SOON * effort.solves), effort.known))
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
        either.append(Candidates.of(candidates.drawing, candidates.weights, guess=guess, errors=candidates.errors))
    for one in either:
        for labels in one.tilings():
            reading = Reading.of(one, labels, effort.known)
            if reading.fits:
                return reading
    return None


def _all_triangles(reading: Reading) -> bool:
    """Whether the 3-cycles, all of them, are the cells."""
    candidates = reading.candidates
    return bool((reading.labels == (candidates.first & (candidates.size == 3))).all())


def _finished(best: Reading | None, begun: Begun, effort: Effort) -> Reading | None:
    """The best of what repairs make of the starts in one drawing, and of a former one."""
    starts = list(begun.starts)
    likeliest = begun.likeliest if starts and not starts[0].like_noise else None
    if likeliest is not None and likeliest.candidates.n_vertices <= SMALL_GRAPH:
        candidates = likeliest.candidates
        triangles = 2 * (candidates.first & (candidates.size == 3)).sum() > candidates.first.sum()
        first = candidates.n_vertices >= FEW and triangles
        starts, likeliest = _with_mended(starts, likeliest, effort, 0 if first else len(starts)), None
    number = 0
    while starts:
        start = starts.pop(0)
        share = effort.share(_FIRST if number == 0 and starts else 1 / (len(starts) + 1))
        best = better(best, start if start.like_noise else repaired(start, share))
        if best.fits or best.like_noise:
            return best
        effort.solves += max(share.solves, 0)
        number += 1
        if likeliest is not None:  # on large graphs this costs more than repairs
            starts, likeliest = _with_mended(starts, likeliest, effort, 0), None
    return best


def _with_mended(starts: list[Reading], likeliest: Reading, effort: Effort, place: int) -> list[Reading]:
    """Starts with a mended one among them, or this alone if it fits."""
    found = mended(likeliest, effort)
    if found is None:
        return starts
    return [found] if found.fits else [*starts[:place], found, *starts[place:]]


def fitting_starts(
    n: int, edges: NDArray, weights: NDArray, scale: float | None = None, errors: NDArray | None = None
) -> Iterator[Reading]:
    """All readings to begin with that fit as they are, in all drawings.

    Parameters are those of :func:`read_cells`.
    """
    known: dict[bytes, PieceMesh | None] = {}
    for candidates in _drawings(n, edges, weights, scale, errors):
        for labels in candidates.starts():
            reading = Reading.of(candidates, labels, known)
            if reading.fits:
                yield reading


def first_reading(n: int, edges: NDArray, weights: NDArray) -> Reading | None:
    """What the angles suggest, without positions: the first choice of cells that makes planar surfaces."""
    for drawing in face_complexes(n, edges):
        candidates = Candidates.of(drawing, weights)
        for labels in candidates.starts():
            reading = Reading.unsolved(candidates, labels)
            if reading.pieces:
                return reading
    return None


def _widened(reading: Reading[Candidates]) -> Reading[Candidates]:
    """The same among more candidates."""
    return Reading.of(*reading.candidates.widened(reading.labels, reading.scale))


def _turned_over(reading: Reading, effort: Effort, solves: int) -> Reading:
    """Parts of the drawing turned over, each because that lowers the misfit; at no more than so many solves."""
    least = effort.solves - solves
    trials = reading.candidates.turned(reading.labels)
    while reading.pieces and not reading.fits and effort.solves > least and (labels := next(trials, None)) is not None:
        trial = effort.reading(reading.candidates, labels)
        if trial.size < 0.999 * reading.size:
            reading, trials = trial, trial.candidates.turned(trial.labels)
    return reading
