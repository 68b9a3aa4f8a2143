"""From a planar graph and its numbers to the cells that fit."""

from __future__ import annotations

import logging

import numpy as np
from numpy.typing import NDArray

from ..topology.embedding import face_complexes
from .candidates import Candidates
from .evidence import label_changes
from .reading import Reading

_log = logging.getLogger(__name__)

_ROUNDS = 25
_CLEAR = 0.35  # a label that is to change by so much is turned over
_SINGLES = 12


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
        own: Reading | None = None
        for labels in candidates.starts():
            own = _better(own, Reading.of(candidates, labels))
            if own.fits:
                return own
        if own is not None and not own.like_noise:
            own = _repaired(own)
        best = _better(best, own) if own is not None else best
        if best is not None and (best.fits or best.like_noise):
            return best
    return best if best is not None and best.pieces else None


def _better(one: Reading | None, other: Reading) -> Reading:
    return other if one is None or other.size < one.size else one


def _repaired(reading: Reading) -> Reading:
    """Turn labels over as the misfit asks for it, until it vanishes or nothing new is left to try."""
    best = reading
    seen = {reading.labels.tobytes()}
    for _ in range(_ROUNDS):
        changes = np.nan_to_num(label_changes(reading))
        labels = next((x for x in _proposals(reading, changes) if x.tobytes() not in seen), None)
        if labels is None:
            break
        seen.add(labels.tobytes())
        turned = np.count_nonzero(labels != reading.labels)
        reading = Reading.of(reading.candidates, labels)
        _log.debug("%d labels turned over: misfit %.1e", turned, reading.size)
        best = _better(best, reading)
        if best.fits or not reading.pieces:
            break
    return best


def _proposals(reading: Reading, changes: NDArray):  # type: ignore[no-untyped-def]
    """Labels to try next: all clear changes together, then the largest one by one."""
    gain = np.where(reading.labels, -changes, changes)
    top = float(gain.max(initial=0.0))
    if not top > 0:
        return
    clear = gain >= max(_CLEAR, 0.6 * top) if top > _CLEAR else gain >= 0.7 * top
    yield _turned(reading, changes, clear)
    for k in np.argsort(-gain, kind="stable")[:_SINGLES]:
        yield _turned(reading, changes, np.arange(len(gain)) == k)


def _turned(reading: Reading, changes: NDArray, turned: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The labels with some turned over; what stands in the way of a new cell goes, bare edges get a cell again."""
    candidates = reading.candidates
    labels = reading.labels
    value = np.where(labels, 1.0, -np.inf)
    value[turned] = np.where(labels[turned], -np.inf, 2.0 + changes[turned])
    chosen = candidates.compatible(value)
    fallback = np.where(changes != 0, labels + changes, candidates.belief) - 10.0 * (turned & labels)
    return candidates.covering(chosen, fallback)
