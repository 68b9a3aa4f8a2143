"""From a planar graph and its numbers to the cells that fit."""

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from ...budget import Budget
from ...topology.embedding import face_complexes
from ..candidates.candidates import Candidates, widened
from ..candidates.choosing import likely_labels
from ..judge.labelling import Labelling
from ..propagate import ContradictionError, lone_scales, told
from ..relax.relaxation import with_holes
from .best_first import BestFirst, Judge, better
from .leaps import leapt
from .options import SEARCH


def label_cells(
    n: int, edges: NDArray, weights: NDArray, scale: float | None, errors: NDArray | None, budget: Budget
) -> Labelling | None:
    """The labelling of a connected planar graph that fits its weights, or else the one that fits best.

    None if no labelling makes a planar surface.

    `edges` (e, 2): pairs i < j in lexicographic order, at least one; `weights` (e,): -A_ij; `scale`: c, where it is
    known; `errors` (e,): standard deviations of those of the weights, where they are known; `budget`: what is left for
    all components.
    """
    judge = Judge(Budget(SEARCH.worth(n), parent=budget), SEARCH.price(n))
    starts: list[Labelling] = []
    for number, embedding in enumerate(face_complexes(n, edges)):
        candidates = Candidates.of(embedding, weights, scale, errors)
        for labels in likely_labels(candidates):
            start = judge(candidates, labels)
            if start.fits:
                return start
            starts += [start] if start.pieces else []
        if not number and SEARCH.least_relaxed <= n <= SEARCH.most_vertices:
            relaxed = _with_holes(candidates, judge.part(SEARCH.relaxing))
            if relaxed is not None and relaxed.fits:
                return relaxed
            starts += [relaxed] if relaxed is not None and relaxed.pieces else []
    best: Labelling | None = None
    searching = judge.part(1 - SEARCH.widening)
    for number, start in enumerate(sorted(starts, key=lambda one: one.mean_misfit)):
        best = better(best, start)
        hopeless = start.misfit.sum() > max(SEARCH.most_left, SEARCH.most_wrong * len(edges))
        if n <= SEARCH.most_vertices and not (hopeless or searching.spent):
            own = searching.part(SEARCH.first if number == 0 else 0.5)
            start = leapt(start, own)
            best = better(best, start if start.fits else BestFirst(start).run(own))
        if best.fits:
            break
    if best is not None and not best.fits and best.size < SEARCH.close and n <= SEARCH.most_vertices:
        candidates = widened(best.candidates, best.edges, best.misfit)
        labels = np.append(best.labels, np.zeros(candidates.count - len(best.labels), dtype=bool))
        best = better(best, BestFirst(Labelling.of(candidates, labels)).run(judge))
    return best


def _with_holes(candidates: Candidates, judge: Judge) -> Labelling | None:
    """Triangles that fit best, where every edge lies on one; with the c that lone triangles tell, if they do."""
    sides, weights = candidates.triangle_sides, candidates.weights
    best: Labelling | None = None
    for c in lone_scales(sides, weights) if candidates.scale is None else [candidates.scale]:
        with suppress(ContradictionError):
            known = Candidates.of(candidates.embedding, weights, c)
            best = _relaxed(known, told(sides, 2 * weights / c), judge.part(0.5))
            break
    if candidates.scale is None and (best is None or not best.fits):
        best = _relaxed(candidates, np.zeros(len(sides), dtype=np.int8), judge) or best
    return best


def _relaxed(candidates: Candidates, state: NDArray[np.int8], judge: Judge) -> Labelling | None:
    found = with_holes(candidates, state)
    if found is None:
        return None
    judge.spend(SEARCH.relaxation)
    labels, free = found
    return BestFirst(judge(candidates, labels), free).run(judge)


def first_labelling(n: int, edges: NDArray, weights: NDArray) -> Labelling | None:
    """What the angles suggest, without positions: the first choice of cells that makes planar surfaces."""
    for embedding in face_complexes(n, edges):
        candidates = Candidates.of(embedding, weights)
        for labels in likely_labels(candidates):
            labelling = Labelling.unsolved(candidates, labels)
            if labelling.pieces:
                return labelling
    return None
