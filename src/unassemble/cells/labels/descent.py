"""The last wrong labels: small changes, those that should leave least first, from the best of all readings so far.

The last wrong labels may have to be put right together: a change for the better can raise the misfit a little. So of
the changes of each reading a few are tried, then a few of another that is about as good.
"""

from __future__ import annotations

import heapq
import logging
from collections.abc import Iterator
from functools import cached_property
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..candidates.candidates import Candidates
from ..reading import Reading
from .effort import Effort
from .exchange import whole
from .leaps import clear_changes
from .moves import turned
from .sheet import Sheet
from .updates import Updates

_log = logging.getLogger(__name__)

_BATCH = 8
"""Small changes of a reading that are tried at a time."""

_IN_VAIN = 40  # changes in all without an improvement
_TRIED = 0.25  # a reading with a batch tried is put off behind those with so much more misfit
_BETTER = 0.9  # misfit, relative to the least before, that is an improvement worth its price
_SOLVES = 10  # that telling what changes would leave is worth
_AT_LEAST, _AT_MOST = 1, 15  # readings whose changes are told before progress is asked for, and that may be worth it
_WORTH_A_BATCH = 0.05  # misfit of a reading whose first changes are all tried, unless one of them is worth its price
_NEARLY, _PATIENCE = 0.01, 8  # misfit of a start that is nearly right, and how many are told of such a one
_BESIDE = 24  # small changes of a reading that fits, those that leave least, that are solved for

_Waiting = tuple[float, int, Reading, Iterator[NDArray[np.bool_]] | None]


def better(one: Reading | None, other: Reading) -> Reading:
    """The one with less misfit."""
    return other if one is None or other.size < one.size else one


class Descent:
    """A search from one reading, which can be taken up again.

    Parameters
    ----------
    start : Reading
    seen : set of bytes, optional
        Outlines of readings that other searches in the same drawing have led to; those of this one are added.
    free : (cells,) bool, optional
        Labels that may change; all of them by default.

    Attributes
    ----------
    best : Reading
    least : float
        Mean misfit so far.
    """

    def __init__(self, start: Reading, *, seen: set[bytes] | None = None, free: NDArray[np.bool_] | None = None):
        self.best = start
        self._candidates = start.candidates
        self._scale = start.scale
        self._free = np.ones(start.candidates.count, dtype=bool) if free is None else free
        self._seen = set() if seen is None else seen
        self._first = self.least = start.mean_misfit
        self._told = self._in_vain = 0
        self._patience = _PATIENCE if start.size < _NEARLY else _AT_LEAST
        # Misfit, more where batches have been tried, a number that settles ties, the reading and its changes.
        self._waiting: list[_Waiting] = [(self.least, -1, start, None)] if start.pieces else []

    @cached_property
    def _updates(self) -> Updates:
        return Updates(Sheet(self._candidates, self._scale), self._free)

    def run(self, effort: Effort) -> Reading:
        """Go on until a reading fits, or the effort is spent, or the search is in vain; the best so far."""
        while self._waiting and not (self.best.fits or effort.spent) and self._in_vain < _IN_VAIN:
            value, number, reading, changed = heapq.heappop(self._waiting)
            if changed is None:
                if self._hopeless:
                    self._waiting.clear()
                    break
                self._seen.add(self._updates.outline(reading.labels))
                self._told += 1
                effort.solves -= _SOLVES
                changed = self._changed(reading)
            asked = 0
            enough = _BETTER * value if reading.size < _WORTH_A_BATCH else value
            for labels in islice(changed, _BATCH):
                asked += 1
                if effort.spent or self._tried(labels, reading, effort) < enough:
                    break
            else:
                value += _TRIED * reading.mean_misfit
            if asked:
                heapq.heappush(self._waiting, (value, number, reading, changed))
        _log.debug("descent: misfit %.1e, %d readings", self.best.size, self._told)
        return self.best

    @property
    def _hopeless(self) -> bool:
        """Whether the misfit, about proportional to the number of wrong labels, will not be gone falling as it has."""
        return self._told >= self._patience and self._told * self.least > _AT_MOST * (self._first - self.least)

    def _tried(self, labels: NDArray[np.bool_], before: Reading, effort: Effort) -> float:
        """The mean misfit of labels that have not been tried before."""
        outline = self._updates.outline(labels)
        if outline in self._seen or (labels != before.labels)[~self._free].any():
            return np.inf
        self._seen.add(outline)
        trial = effort.reading(self._candidates, labels)
        self.best, value = better(self.best, trial), trial.mean_misfit
        self._in_vain = 0 if value < self.least else self._in_vain + 1
        if value < _BETTER * self.least:  # what led here was not in vain
            effort.solves += _SOLVES
        self.least = min(value, self.least)
        if trial.pieces:
            heapq.heappush(self._waiting, (value, len(self._seen), trial, None))
        return value

    def _changed(self, reading: Reading) -> Iterator[NDArray[np.bool_]]:
        """Changes of the labels of a reading; where the first few are in vain, also all clear ones at once."""
        for k, move in enumerate(self._updates.ranked(reading)):
            if k == _BATCH:
                yield clear_changes(reading)
            yield whole(reading.candidates, turned(reading.labels, move))


def beside(reading: Reading) -> Iterator[Reading]:
    """Readings that fit as well as one that does, and differ from it by one label or two that touch."""
    candidates = reading.candidates
    updates = Updates(Sheet(candidates, reading.scale))
    seen = {updates.outline(reading.labels)}
    for move in islice(updates.ranked(reading, leaders=candidates.count, levels=2), _BESIDE):
        labels = turned(reading.labels, move)
        if (outline := updates.outline(labels)) not in seen:
            seen.add(outline)
            other = Reading.of(candidates, labels)
            if other.fits:
                yield other


def as_good(reading: Reading[Candidates], about: NDArray[np.bool_], usual: NDArray[np.bool_]) -> Iterator[Reading]:
    """Readings that fit as well as one that does, with the same c, and differ by one label or two that touch.

    One of them is among those, (cells,) bool, that this is `about`, the other among the `usual` ones.
    """
    for move in Updates(Sheet(reading.candidates, reading.scale)).as_good(reading, about, usual):
        other = Reading.of(reading.candidates, turned(reading.labels, move))
        if other.fits:
            yield other
