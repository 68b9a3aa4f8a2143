"""From a planar graph and its numbers to the cells that fit."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..topology.embedding import face_complexes
from .candidates import Candidates
from .evidence import label_changes
from .reading import Reading

_log = logging.getLogger(__name__)

_PATIENCE = 6  # leaps without an improvement
_SOLVES = 150
_CLEAR = 0.35  # a label that is to change by so much is turned over
_SINGLES = 8
_EXCHANGES = 48
_LIKELY = 100  # candidates that take part in exchanges


def read_cells(n: int, edges: NDArray, weights: NDArray) -> Reading | None:
    """The reading of a connected planar graph that fits its weights, or else the one that fits best.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
        Pairs i < j in lexicographic order; at least one.
    weights : (e,) float64
        -A_ij of each edge.

    Returns
    -------
    Reading or None
        None if no reading makes a planar surface.
    """
    best: Reading | None = None
    for drawing in face_complexes(n, edges):
        candidates = Candidates.of(drawing, weights)
        starts = []
        for labels in candidates.starts():
            starts.append(Reading.of(candidates, labels))
            if starts[-1].fits:
                return starts[-1]
        for start in sorted(starts, key=lambda reading: reading.size):
            best = _better(best, start if start.like_noise else _repaired(start))
            if best.fits:
                return best
    return best if best is not None and best.pieces else None


def _better(one: Reading | None, other: Reading) -> Reading:
    return other if one is None or other.size < one.size else one


def _repaired(reading: Reading) -> Reading:
    """Turn labels over as the misfit asks for it."""
    best = _leaps(reading)
    return best if best.fits else _descent(best)


def _leaps(reading: Reading) -> Reading:
    """All clear changes at once, uphill too: with many wrong cells the misfit of the way is no guide."""
    best, since_best = reading, 0
    seen = {reading.labels.tobytes()}
    while reading.pieces and not reading.fits and since_best < _PATIENCE:
        changes = np.nan_to_num(label_changes(reading))
        labels = next((x for x in _proposals(reading, changes) if x.tobytes() not in seen), None)
        if labels is None:
            break
        seen.add(labels.tobytes())
        reading = Reading.of(reading.candidates, labels)
        since_best = 0 if reading.size < best.size else since_best + 1
        best = _better(best, reading)
        _log.debug("leap: misfit %.1e", reading.size)
    return best


def _descent(reading: Reading) -> Reading:
    """Small changes, each of which lowers the misfit."""
    solves = 0
    while solves < _SOLVES and reading.pieces and not reading.fits:
        changes = np.nan_to_num(label_changes(reading))
        for labels in _proposals(reading, changes):
            trial = Reading.of(reading.candidates, labels)
            solves += 1
            if trial.size < reading.size or solves == _SOLVES:
                break
        else:
            return reading
        reading = _better(reading, trial)
        _log.debug("descent: misfit %.1e", reading.size)
    return reading


def _proposals(reading: Reading, changes: NDArray) -> Iterator[NDArray[np.bool_]]:
    """Labels to try next: all clear changes together, then the largest one by one, then exchanges of neighbours."""
    gain = np.where(reading.labels, -changes, changes)
    top = float(gain.max(initial=0.0))
    if not top > 0:
        return
    seen = {reading.labels.tobytes()}
    clear = gain >= max(_CLEAR, 0.6 * top) if top > _CLEAR else gain >= 0.7 * top
    singles = [np.array([k]) for k in np.argsort(-gain, kind="stable")[:_SINGLES]]
    for turned in (np.flatnonzero(clear), *singles, *_exchanges(reading, gain)):
        labels = _turned(reading, changes, turned)
        if labels.tobytes() not in seen:
            seen.add(labels.tobytes())
            yield labels


def _exchanges(reading: Reading, gain: NDArray) -> NDArray[np.int64]:
    """(k, 2) a cell and an empty candidate that share a vertex: a hole that is to move."""
    cells, labels = reading.candidates.cells, reading.labels
    owner = np.repeat(np.arange(cells.count), cells.size)
    incidence = sp.csr_array(
        (np.ones(len(owner)), (owner, cells.vertices)), shape=(cells.count, reading.candidates.n_vertices)
    )
    by_gain = np.argsort(-gain, kind="stable")
    full, empty = (by_gain[which[by_gain]][:_LIKELY] for which in (labels, ~labels & ~reading.candidates.corner))
    touching = (incidence[full] @ incidence[empty].T).tocoo()
    pairs = np.column_stack([full[touching.row], empty[touching.col]])
    return pairs[np.argsort(-gain[pairs].sum(axis=1), kind="stable")[:_EXCHANGES]]


def _turned(reading: Reading, changes: NDArray, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """The labels with some turned over; what stands in the way of a new cell goes, bare edges get a cell again."""
    candidates = reading.candidates
    labels = reading.labels
    turned = np.zeros(len(labels), dtype=bool)
    turned[rows] = True
    value = np.where(labels, 1.0, -np.inf)
    value[turned] = np.where(labels[turned], -np.inf, 2.0 + changes[turned])
    chosen = candidates.compatible(value)
    fallback = np.where(changes != 0, labels + changes, candidates.belief) - 10.0 * (turned & labels)
    return candidates.covering(chosen, fallback)
