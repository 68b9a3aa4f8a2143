"""Small changes of readings that do not fit: of labels, of what may be a cell, of the drawing."""

from __future__ import annotations

from collections.abc import Iterable

from .candidates.candidates import Candidates
from .candidates.turned_over import with_a_part_turned_over
from .labels.descent import Descent, better
from .labels.effort import Effort
from .reading import Reading

CLOSE = 0.15
"""Misfit of readings with few wrong labels."""

QUICK = 36
"""Solves for small changes of a start, those of three readings."""

SOME = 60
"""The same of a reading that is nearly right, or the nearest when all else has failed."""

_MOST_ROUNDS = 4  # parts that are turned over in a reading, one after the other
_LIKELIEST = 3  # readings with one of them turned over that are gone on with


def tried_out(best: Reading, searches: list[Descent]) -> Reading:
    """The best of what small changes make of a reading, and of the starts of others; if that is close, of more cells.

    Parameters
    ----------
    best : Reading
        That does not fit.
    searches : list of Descent
        For small changes of each start, on small graphs.
    """
    best = best_of(best, searches, QUICK)
    nearest = sorted(searches, key=lambda search: search.least)[:1]
    if all(search.best is not best for search in nearest):
        nearest.append(Descent(best))
    best = best if best.fits else best_of(best, nearest, SOME)
    if best.size > CLOSE or best.fits or not isinstance(best.candidates, Candidates):
        return best
    return best_of(best, [Descent(widened(best))], SOME)


def with_parts_turned_over(best: Reading[Candidates], effort: Effort) -> Reading[Candidates]:
    """What small changes make of a reading with parts of its drawing turned over, one after the other."""
    for _ in range(_MOST_ROUNDS):
        before = best
        trials = [
            Reading.of(*turned, effort.known)
            for turned in with_a_part_turned_over(best.candidates, best.labels, best.scale)
        ]
        trials = sorted(trials, key=lambda trial: trial.mean_misfit)[:_LIKELIEST]
        best = best_of(best, map(Descent, trials), QUICK)
        if best is before or best.fits:
            break
    return best


def best_of(best: Reading, searches: Iterable[Descent], solves: int) -> Reading:
    """The best that any search comes to with so many solves, or a former one."""
    for search in searches:
        best = better(best, search.run(Effort(solves)))
        if best.fits:
            break
    return best


def widened(reading: Reading[Candidates]) -> Reading[Candidates]:
    """The same among more candidates."""
    return Reading.of(*reading.candidates.widened(reading.labels, reading.scale))
