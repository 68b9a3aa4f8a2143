"""Labels turned over as the misfit asks for it: many at once, then few."""

from __future__ import annotations

import heapq
import logging
from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..reading import Reading
from .effort import Effort
from .evidence import label_changes
from .exchange import whole
from .leaps import clear_changes
from .sheet import Sheet
from .updates import Updates

_log = logging.getLogger(__name__)

_BATCH = 8
"""Small changes of a reading that are tried at a time."""

_IN_VAIN = 40  # small changes in all without an improvement
_TRIED = 0.25  # a reading with a batch tried is put off behind those with so much more misfit
_SOLVES = 10  # that telling what changes would leave is worth
_AT_LEAST, _AT_MOST = 4, 30  # readings whose changes are told before progress is asked for, and that may be worth it
_BESIDE = 24  # small changes of a reading that fits, those that leave least, that are solved for
_PATIENCE = 6  # leaps without an improvement; fewer where they are long

_Waiting = tuple[float, int, Reading, Iterator[NDArray[np.bool_]] | None]


def better(one: Reading | None, other: Reading) -> Reading:
    """The one with less misfit."""
    return other if one is None or other.size < one.size else one


def repaired(reading: Reading, effort: Effort) -> Reading:
    """Turn labels over as the misfit asks for it."""
    best = _leaps(reading, effort)
    return best if best.fits else descent(best, effort)


def _leaps(reading: Reading, effort: Effort) -> Reading:
    """All clear changes at once, uphill too: with many wrong cells the misfit of the way is no guide."""
    best, since_best, progress = reading, 0, effort.progress(reading, _PATIENCE)
    patience = np.clip(3e4 / reading.candidates.n_vertices, 2, _PATIENCE)
    seen = {reading.labels.tobytes()}
    while reading.pieces and not reading.fits and since_best < patience and progress.suffices(best.size):
        labels = clear_changes(reading, np.nan_to_num(label_changes(reading)))
        if labels.tobytes() in seen:
            break
        seen.add(labels.tobytes())
        reading = effort.reading(reading.candidates, labels)
        since_best = 0 if reading.size < best.size else since_best + 1
        best = better(best, reading)
        _log.debug("leap: misfit %.1e", reading.size)
    return best


def descent(
    reading: Reading, effort: Effort, *, seen: set[bytes] | None = None, free: NDArray[np.bool_] | None = None
) -> Reading:
    """Small changes, those that should leave least first, from the best of all readings that they have led to.

    The last wrong labels may have to be put right together: a change for the better can raise the misfit a little. So
    of the changes of each reading a few are tried, then a few of another that is about as good. The mean misfit is
    about proportional to the number of wrong labels: if it had to go on falling as it has, it should be gone in time.

    Parameters
    ----------
    reading : Reading
    effort : Effort
    seen : set of bytes, optional
        Outlines of readings that others in the same drawing have led to; those that are solved for are added.
    free : (cells,) bool, optional
        Labels that may change; all of them by default.
    """
    if not reading.pieces or reading.fits:
        return reading
    best, first, in_vain, candidates = reading, _value(reading), 0, reading.candidates
    free = np.ones(candidates.count, dtype=bool) if free is None else free
    updates = Updates(Sheet(candidates, _scale(reading)), free)
    seen = set() if seen is None else seen
    seen.add(updates.outline(reading.labels))
    least, told = first, 0
    # Misfit, more where batches have been tried, a number that settles ties, the reading and its changes.
    waiting: list[_Waiting] = [(least, 0, reading, None)]
    while waiting and not (best.fits or effort.spent) and in_vain < _IN_VAIN:
        value, number, reading, changed = heapq.heappop(waiting)
        if changed is None:
            if told >= _AT_LEAST and told * least > _AT_MOST * (first - least):
                break
            told += 1
            effort.solves -= _SOLVES
            changed = _changed(reading, updates)
        asked = 0
        for labels in islice(changed, _BATCH):
            asked += 1
            outline = updates.outline(labels)
            if outline in seen or effort.spent or (labels != reading.labels)[~free].any():
                continue
            seen.add(outline)
            trial = effort.reading(candidates, labels)
            best, after = better(best, trial), _value(trial)
            in_vain = 0 if after < least else in_vain + 1
            if after < least:  # what led here was not in vain
                effort.solves += _SOLVES
            least = min(after, least)
            if trial.pieces:
                heapq.heappush(waiting, (after, len(seen), trial, None))
            if after < value:
                break
        else:
            value += _TRIED * _value(reading)
        if asked:
            heapq.heappush(waiting, (value, number, reading, changed))
    _log.debug("descent: misfit %.1e, %d readings", best.size, told)
    return best


def _changed(reading: Reading, updates: Updates) -> Iterator[NDArray[np.bool_]]:
    """Changes of the labels of a reading; nothing is computed before the first is asked for."""
    yield clear_changes(reading, np.nan_to_num(label_changes(reading)))
    for move in updates.ranked(reading):
        labels = reading.labels.copy()
        labels[list(move)] ^= True
        yield whole(reading.candidates, labels)


def beside(reading: Reading) -> Iterator[Reading]:
    """Readings that fit as well as one that does, and differ from it by one label or two that touch."""
    candidates = reading.candidates
    updates = Updates(Sheet(candidates, _scale(reading)))
    seen = {updates.outline(reading.labels)}
    for move in islice(updates.ranked(reading, leaders=candidates.count, levels=2), _BESIDE):
        labels = reading.labels.copy()
        labels[list(move)] ^= True
        if (outline := updates.outline(labels)) not in seen:
            seen.add(outline)
            other = Reading.of(candidates, labels)
            if other.fits:
                yield other


def _value(reading: Reading) -> float:
    """Mean misfit: where little is wrong it is smaller than where all is wrong a little."""
    return float(reading.misfit.mean())


def _scale(reading: Reading) -> float:
    """The c of the largest piece."""
    solved = [
        (piece.n_vertices, mesh.scale) for piece, mesh in zip(reading.pieces, reading.meshes, strict=True) if mesh
    ]
    return reading.candidates.scale or max(solved, default=(0, 1.0))[1]
