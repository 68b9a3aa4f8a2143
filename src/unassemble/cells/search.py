"""From a planar graph and its numbers to the cells that fit."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from .beginning import A_FEW, Begun, begun, drawings
from .block_by_block import read_block_by_block
from .candidates.candidates import FEW, Candidates
from .candidates.cell_set import CellSet
from .candidates.turned_over import with_less_strain
from .covers.covering import MOST_EQUAL_CELLS, read_by_cover
from .labels.descent import Descent, better
from .labels.effort import SMALL_GRAPH, Effort
from .labels.mending import mended
from .labels.relaxation import HopelessError
from .labels.repairs import repaired
from .reading import Reading
from .reordered import read_in_other_orders
from .small_changes import CLOSE, SOME, best_of, tried_out, with_parts_turned_over
from .triangles.drawings import read_in_drawings
from .triangles.many_holes import read_with_holes
from .triangles.triangles_only import read_triangles

_DRAWINGS = 3  # that a graph may have, about
_TURNING = 0.5  # part of the effort for turning parts over, in all drawings that are begun with
_FIRST = 0.7  # part of it for the likeliest reading
_QUICKLY = 0.2  # part of it that the same graph is worth once more
_ONCE_MORE = 0.4  # part of it that the same graph is worth among all candidates
_EQUAL = 1e-9  # relative difference of weights that are all the same
_SMALL_PART = 0.5  # of the edges: blocks that are read by themselves before all else
_FEW_TURNS = 8  # solves for turning parts over in each drawing of a graph that is not worth more


def read_cells(
    n: int,
    edges: NDArray,
    weights: NDArray,
    scale: float | None = None,
    errors: NDArray | None = None,
    *,
    quick: bool = False,
    covers: bool = True,
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
    quick : bool
        Whether to try a fifth of what is worth trying where nothing else is known of the graph.
    covers : bool
        Whether to try exact covers, to which the order of the vertices makes no difference.

    Returns
    -------
    Reading or None
        None if no reading makes a planar surface.
    """
    if np.ptp(weights) <= _EQUAL * np.abs(weights).max():
        return _of_equal_weights(n, edges, weights, scale, errors)
    effort = Effort.for_graph(n, _QUICKLY if quick else 1.0)
    triangles = read_triangles(n, edges, weights, scale, effort)
    if triangles is None and n >= FEW:  # many drawings take longer than a few paths
        triangles = read_with_holes(n, edges, weights, scale)
    if triangles is None:
        triangles = read_in_drawings(n, edges, weights, scale, errors)
    if triangles is None and n < FEW:
        triangles = read_with_holes(n, edges, weights, scale)
    if triangles is not None:
        return triangles
    best, spoilt = _searched(n, edges, weights, scale, errors, effort, thorough=not quick, covers=covers)
    if best is None:
        return spoilt
    if not _stands(best):
        best = read_block_by_block(best, partial(read_cells, quick=quick)) or best
    if not (_stands(best) or quick) and n < FEW and best.size < CLOSE:
        again = read_in_other_orders(partial(read_cells, quick=True, covers=False), n, edges, weights, scale, errors)
        best = again or _among_all(best, n, edges, weights, scale, errors)
    return best if spoilt is None or _stands(best) else spoilt


def _stands(reading: Reading) -> bool:
    """Whether there is nothing to be bettered by other cells."""
    return reading.fits or reading.fits_but_for_few or reading.like_noise


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
    thorough: bool = True,
    covers: bool = True,
) -> tuple[Reading | None, Reading | None]:
    """The best reading, and the one with entries set aside as wrong that stands where none fits.

    `guess` and `wide` are as for :class:`Candidates`, `covers` as above; if not `thorough`, nothing more is tried at
    last.
    """
    best: Reading | None = None
    spoilt: Reading | None = None
    together = n <= SMALL_GRAPH
    turning = _TURNING / (_DRAWINGS if together else 1)
    every = drawings(n, edges, weights, scale, errors, guess, wide=wide)
    cover = cache(partial(read_by_cover, n, edges, weights, scale, errors)) if covers else _no_cover
    beginnings: list[Begun] = []
    done = False
    # Repairs take most of the effort: small graphs are begun with in all drawings before.
    for some in [every] if together else ([drawing] for drawing in every):
        beginnings.clear()
        for drawing in some:
            beginnings.append(begun(drawing, effort, int(turning * effort.solves)))
            if beginnings[-1].settled:
                return _settled(best, beginnings[-1].starts[0]), spoilt
            spoilt = spoilt or beginnings[-1].spoilt
            for start in beginnings[-1].starts:
                found = read_block_by_block(start, partial(read_cells, quick=not thorough), _SMALL_PART)
                if found is not None:
                    return found, spoilt
        for one in beginnings:
            best, done = _carried_on(best, one, effort, cover)
            if done:
                break
        if done:
            break
    if best is None or not best.pieces:
        return None, spoilt
    if thorough and not (best.fits or best.like_noise):
        searches = [search for one in beginnings for search in one.descents] if n < FEW else []
        best = tried_out(best, searches)
        best = _redrawn(best, effort) if together else best
    return best, spoilt


def _among_all(
    best: Reading, n: int, edges: NDArray, weights: NDArray, scale: float | None, errors: NDArray | None
) -> Reading:
    """What a search among all candidates comes to, if that stands; else the reading, nearly right, that there was.

    Angles are judged by its c, which is better than a first guess, and then by such a guess again: where either leads
    to depends on little things.
    """
    for guess in (best.scale, None) if scale is None else (None,):
        effort = Effort.for_graph(n, _ONCE_MORE)
        again, _ = _searched(n, edges, weights, scale, errors, effort, guess, wide=True, covers=False)
        if again is not None and _stands(again):
            return again
    return best


def _no_cover() -> None:
    """In place of one that has been tried."""


def _redrawn(best: Reading, effort: Effort) -> Reading:
    """A reading, or, if it is nearly right, what small changes make of it with parts turned over, or of new starts."""
    if best.fits or best.size > CLOSE or not isinstance(best.candidates, Candidates):
        return best
    best = with_parts_turned_over(best, effort)
    candidates = None if best.fits else with_less_strain(best.candidates)
    if candidates is None:
        return best
    first = begun(candidates, Effort(SOME, effort.known), _FEW_TURNS)
    if first.settled:
        return _settled(best, first.starts[0])
    return best_of(best, first.descents, SOME)


def _of_equal_weights(
    n: int, edges: NDArray, weights: NDArray, scale: float | None, errors: NDArray | None
) -> Reading | None:
    """A reading that fits of a graph whose weights are all the same, or the best of those to begin with.

    They give the misfit no place to lead to: what is not read at once, or by a cover, most likely is a graph's
    Laplacian, and belongs to no mesh.
    """
    effort, best = Effort.for_graph(n), None
    for drawing in drawings(n, edges, weights, scale, errors):
        for start in begun(drawing, effort, _FEW_TURNS).starts:
            best = better(best, start)
        if best is not None and best.fits:
            return best
    return read_by_cover(n, edges, weights, scale, errors, most_cells=MOST_EQUAL_CELLS) or (
        Descent(best).run(Effort(A_FEW, effort.known)) if best is not None and best.pieces else None
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
    if best is not None and best is not before and best.size < CLOSE:  # covers take longer than a few small changes
        best = Descent(best).run(Effort(SOME, effort.known))
        if best.fits:
            return best, True
    covered = cover()
    if covered is not None:
        return covered, True
    return (best if best is not None and best.pieces else None), hopeless


def _finished(best: Reading | None, begun: Begun, effort: Effort) -> Reading | None:
    """The best of what repairs make of the starts in one drawing, and of a former one."""
    starts = list(begun.starts)
    likeliest = begun.likeliest if starts and not starts[0].like_noise else None
    if likeliest is not None and likeliest.candidates.n_vertices <= SMALL_GRAPH:
        candidates = likeliest.candidates
        triangles = 2 * candidates.triangles.sum() > candidates.first.sum()
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
