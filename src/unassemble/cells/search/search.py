"""From a planar graph and its numbers to the cells that fit."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from ...budget import Budget
from ...topology.embedding import face_complexes
from ..candidates.candidates import Candidates
from ..candidates.starts import likely_labels
from ..candidates.widened import widened
from ..judge.labelling import Labelling
from ..propagate.peeling import ContradictionError, lone_scales, peeled
from ..relax.holes import with_holes
from .best_first import BestFirst, Judge, better, leapt

MOST_VERTICES = 20_000
"""Up to which labels are relaxed and searched for."""

_WORK, _LEAST, _MOST = 1.2e5, 12, 500
"""Vertices times solves that a graph is worth, and the least and the largest number of solves."""

_FIRST = 0.7
"""Part of what is left for the likeliest start; half for each of the others."""

_SOLVES = 300
"""For the last wrong labels after a relaxation."""

_CLOSE, _WIDE = 0.15, 300
"""Misfit of a labelling that few cells are missing in, and solves for these."""

_FEW = 60
"""Vertices below which relaxations have nothing to go on."""


def label_cells(
    n: int, edges: NDArray, weights: NDArray, scale: float | None = None, errors: NDArray | None = None
) -> Labelling[Candidates] | None:
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

    Returns
    -------
    Labelling or None
        None if no labelling makes a planar surface.
    """
    judge = Judge(Budget(float(np.clip(_WORK, _LEAST * n, _MOST * n))))
    starts: list[Labelling[Candidates]] = []
    for number, candidates in enumerate(embedded(n, edges, weights, scale, errors)):
        for labels in likely_labels(candidates):
            start = judge(candidates, labels)
            if start.fits:
                return start
            starts += [start] if start.pieces else []
        if not number and _FEW <= n <= MOST_VERTICES:
            relaxed = _with_holes(candidates)
            if relaxed is not None and relaxed.fits:
                return relaxed
            starts += [relaxed] if relaxed is not None and relaxed.pieces else []
    best: Labelling[Candidates] | None = None
    for number, start in enumerate(sorted(starts, key=lambda one: one.mean_misfit)):
        best = better(best, start)
        if n <= MOST_VERTICES and not judge.spent:
            judge.budget, whole = judge.budget.share(_FIRST if number == 0 else 0.5), judge.budget
            start = leapt(start, judge)
            best = better(best, start if start.fits else BestFirst(start).run(judge))
            judge.budget = whole
        if best.fits:
            break
    if best is not None and not best.fits and best.size < _CLOSE and n <= MOST_VERTICES:
        best = better(best, BestFirst(_widened(best)).run(Judge(Budget(float(_WIDE * n)))))
    return best


def _widened(labelling: Labelling[Candidates]) -> Labelling[Candidates]:
    """The same labels among more candidates."""
    candidates = widened(labelling.candidates, labelling.edges, labelling.misfit)
    labels = np.zeros(candidates.count, dtype=bool)
    labels[: len(labelling.labels)] = labelling.labels
    return Labelling.of(candidates, labels)


def _with_holes(candidates: Candidates) -> Labelling[Candidates] | None:
    """Triangles that fit best, where every edge lies on one; with the c that lone triangles tell, if they do."""
    sides, weights = candidates.triangle_sides, candidates.weights
    for c in lone_scales(sides, weights) if candidates.scale is None else [candidates.scale]:
        with suppress(ContradictionError):
            state = peeled(sides, 2 * weights / c)
            relaxed = with_holes(Candidates.of(candidates.embedding, weights, c), state, _last_labels)
            if relaxed is None or relaxed.fits or candidates.scale is not None:
                return relaxed
            break
    return with_holes(candidates, np.zeros(len(sides), dtype=np.int8), _last_labels)


def _last_labels(labelling: Labelling[Candidates], free: NDArray[np.bool_]) -> Labelling[Candidates]:
    judge = Judge(Budget(float(_SOLVES * labelling.candidates.n_vertices)))
    return BestFirst(labelling, free).run(judge)


def embedded(
    n: int, edges: NDArray, weights: NDArray, scale: float | None = None, errors: NDArray | None = None
) -> Iterator[Candidates]:
    """What may be cells in each embedding."""
    for embedding in face_complexes(n, edges):
        yield Candidates.of(embedding, weights, scale, errors)


def first_labelling(n: int, edges: NDArray, weights: NDArray) -> Labelling[Candidates] | None:
    """What the angles suggest, without positions: the first choice of cells that makes planar surfaces."""
    for embedding in face_complexes(n, edges):
        candidates = Candidates.of(embedding, weights)
        for labels in likely_labels(candidates):
            labelling = Labelling.unsolved(candidates, labels)
            if labelling.pieces:
                return labelling
    return None
