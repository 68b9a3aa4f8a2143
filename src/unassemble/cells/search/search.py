"""From a planar graph and its numbers to the cells that fit."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from ...budget import Budget
from ...topology.embedding import face_complexes
from ..candidates.candidates import Candidates
from ..candidates.choosing import likely_labels
from ..candidates.widened import widened
from ..judge.labelling import Labelling
from ..propagate.peeling import ContradictionError, lone_scales, peeled
from ..relax.relaxation import with_holes
from .best_first import BestFirst, Judge, better, leapt
from .options import DEFAULT, SearchOptions


def label_cells(
    n: int,
    edges: NDArray,
    weights: NDArray,
    scale: float | None = None,
    errors: NDArray | None = None,
    budget: Budget | None = None,
    options: SearchOptions = DEFAULT,
) -> Labelling | None:
    """The labelling of a connected planar graph that fits its weights, or else the one that fits best.

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
    budget : Budget, optional
        What is left for all components.
    options : SearchOptions

    Returns
    -------
    Labelling or None
        None if no labelling makes a planar surface.
    """
    judge = Judge(Budget(options.worth(n), parent=budget), options.price(n))
    starts: list[Labelling] = []
    for number, candidates in enumerate(embedded(n, edges, weights, scale, errors)):
        for labels in likely_labels(candidates):
            start = judge(candidates, labels)
            if start.fits:
                return start
            starts += [start] if start.pieces else []
        if not number and options.least_relaxed <= n <= options.most_vertices:
            relaxed = _with_holes(candidates, judge.part(options.relaxing), options)
            if relaxed is not None and relaxed.fits:
                return relaxed
            starts += [relaxed] if relaxed is not None and relaxed.pieces else []
    best: Labelling | None = None
    searching = judge.part(1 - options.widening)
    for number, start in enumerate(sorted(starts, key=lambda one: one.mean_misfit)):
        best = better(best, start)
        hopeless = start.misfit.sum() > max(options.most_left, options.most_wrong * len(edges))
        if n <= options.most_vertices and not (hopeless or searching.spent):
            own = searching.part(options.first if number == 0 else 0.5)
            start = leapt(start, own, options)
            best = better(best, start if start.fits else BestFirst(start, options=options).run(own))
        if best.fits:
            break
    if best is not None and not best.fits and best.size < options.close and n <= options.most_vertices:
        best = better(best, BestFirst(_widened(best), options=options).run(judge))
    return best


def _widened(labelling: Labelling) -> Labelling:
    """The same labels among more candidates."""
    candidates = widened(labelling.candidates, labelling.edges, labelling.misfit)
    labels = np.zeros(candidates.count, dtype=bool)
    labels[: len(labelling.labels)] = labelling.labels
    return Labelling.of(candidates, labels)


def _with_holes(candidates: Candidates, judge: Judge, options: SearchOptions) -> Labelling | None:
    """Triangles that fit best, where every edge lies on one; with the c that lone triangles tell, if they do."""
    sides, weights = candidates.triangle_sides, candidates.weights
    best: Labelling | None = None
    for c in lone_scales(sides, weights) if candidates.scale is None else [candidates.scale]:
        with suppress(ContradictionError):
            known = Candidates.of(candidates.embedding, weights, c)
            best = _relaxed(known, peeled(sides, 2 * weights / c), judge.part(0.5), options)
            break
    if candidates.scale is None and (best is None or not best.fits):
        best = _relaxed(candidates, np.zeros(len(sides), dtype=np.int8), judge, options) or best
    return best


def _relaxed(candidates: Candidates, state: NDArray[np.int8], judge: Judge, options: SearchOptions) -> Labelling | None:
    found = with_holes(candidates, state)
    if found is None:
        return None
    judge.spend(options.relaxation)
    labels, free = found
    return BestFirst(judge(candidates, labels), free, options).run(judge)


def embedded(
    n: int, edges: NDArray, weights: NDArray, scale: float | None = None, errors: NDArray | None = None
) -> Iterator[Candidates]:
    """What may be cells in each embedding."""
    for embedding in face_complexes(n, edges):
        yield Candidates.of(embedding, weights, scale, errors)


def first_labelling(n: int, edges: NDArray, weights: NDArray) -> Labelling | None:
    """What the angles suggest, without positions: the first choice of cells that makes planar surfaces."""
    for embedding in face_complexes(n, edges):
        candidates = Candidates.of(embedding, weights)
        for labels in likely_labels(candidates):
            labelling = Labelling.unsolved(candidates, labels)
            if labelling.pieces:
                return labelling
    return None
