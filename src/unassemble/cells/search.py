"""From a planar graph and its numbers to the cells that fit."""

from __future__ import annotations

import logging

import numpy as np
from numpy.typing import NDArray

from ..topology.embedding import face_complexes
from .candidates import Candidates
from .evidence import label_changes
from .proposals import proposals
from .reading import Reading

_log = logging.getLogger(__name__)

_STARTS = 2  # readings to begin with that are worth repairing
_WORK = 1e5  # vertices times solves that small changes may take
_SUSPECT = 0.3  # change of the label of a lone triangular hole: it was 0.4 or more in all that were tried
_PATIENCE = 6  # leaps without an improvement; fewer where they are long
_SOLVES = 80


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
        if starts and _entries_are_to_blame(starts[0]):
            return _better(best, starts[0])
        for start in sorted(starts, key=lambda reading: reading.size)[:_STARTS]:
            best = _better(best, start if start.like_noise else _repaired(start))
            if best.fits:
                return best
    return best if best is not None and best.pieces else None


def _better(one: Reading | None, other: Reading) -> Reading:
    return other if one is None or other.size < one.size else one


def _entries_are_to_blame(reading: Reading) -> bool:
    """Whether triangles alone do not fit, and none of them is suspected of being a hole: no choice of cells helps."""
    candidates, labels = reading.candidates, reading.labels
    if not reading.pieces or (labels & ((candidates.size > 3) | candidates.corner)).any():
        return False
    return float(np.nan_to_num(np.abs(label_changes(reading))).max(initial=0.0)) < _SUSPECT


def _repaired(reading: Reading) -> Reading:
    """Turn labels over as the misfit asks for it."""
    best = _leaps(reading)
    return best if best.fits else _descent(best)


def _leaps(reading: Reading) -> Reading:
    """All clear changes at once, uphill too: with many wrong cells the misfit of the way is no guide."""
    best, since_best = reading, 0
    patience = np.clip(3e4 / reading.candidates.n_vertices, 2, _PATIENCE)
    seen = {reading.labels.tobytes()}
    while reading.pieces and not reading.fits and since_best < patience:
        changes = np.nan_to_num(label_changes(reading))
        labels = next((x for x in proposals(reading, changes) if x.tobytes() not in seen), None)
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
    solves, most = 0, int(np.clip(_WORK / reading.candidates.n_vertices, 5, _SOLVES))
    while solves < most and reading.pieces and not reading.fits:
        changes = np.nan_to_num(label_changes(reading))
        for labels in proposals(reading, changes):
            trial = Reading.of(reading.candidates, labels)
            solves += 1
            if trial.size < reading.size or solves == most:
                break
        else:
            return reading
        reading = _better(reading, trial)
        _log.debug("descent: misfit %.1e", reading.size)
    return reading
