"""The last wrong labels: small changes, those that should leave least first, from the best of all labellings so far.

The last wrong labels may have to be put right together: a change for the better can raise the misfit a little. So of
the changes of each labelling a few are tried, then a few of another that is about as good.
"""

from __future__ import annotations

import heapq
import logging
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ...budget import Budget
from ...planar.piece import PieceMesh
from ..candidates.candidates import Candidates
from ..candidates.choosing import chosen
from ..judge.labelling import Labelling
from ..relax.sheet import Sheet
from .low_rank import Move, turned
from .options import SEARCH
from .updates import Updates

_log = logging.getLogger(__name__)

_Waiting = tuple[float, int, Labelling, Iterator[NDArray[np.bool_]] | None]


@dataclass(frozen=True)
class Judge:
    """Solves labellings of one graph at the expense of a budget, each at a price; pieces are solved once."""

    budget: Budget
    price: float
    _known: dict[bytes, PieceMesh | None] = field(default_factory=dict)

    def __call__(self, candidates: Candidates, labels: NDArray[np.bool_]) -> Labelling:
        """A labelling, its cost taken."""
        labelling = Labelling.of(candidates, labels, self._known)
        self.spend(1 + len(labelling.pieces) // 20)
        return labelling

    def spend(self, solves: float) -> None:
        """Take so many solves, or what is left."""
        self.budget.take(min(solves * self.price, self.budget.left))

    def part(self, fraction: float) -> Judge:
        """The same with a fraction of what is left."""
        return Judge(self.budget.share(fraction), self.price, self._known)

    @property
    def spent(self) -> bool:
        """Whether it is time to give up."""
        return self.budget.left <= 0


def better(one: Labelling | None, other: Labelling) -> Labelling:
    """The one with less misfit."""
    return other if one is None or other.size < one.size else one


class BestFirst:
    """A search from one labelling, that has pieces.

    `free` (cells,): labels that may change; all of them by default.
    """

    def __init__(self, start: Labelling, free: NDArray[np.bool_] | None = None):
        self.best = start
        self._candidates, self._scale = start.candidates, start.scale
        self._n_faces = int(start.candidates.sides[:, 0].max(initial=-1)) + 1
        self._free = np.ones(start.candidates.count, dtype=bool) if free is None else free
        self._seen: set[bytes] = set()
        self._first = self._least = start.mean_misfit
        self._ranked = self._in_vain = 0
        # Misfit, more where batches have been tried, a number that settles ties, the labelling and its changes.
        near = start.pieces and start.misfit.sum() <= SEARCH.most_left
        self._waiting: list[_Waiting] = [(self._least, -1, start, None)] if near else []

    @cached_property
    def _updates(self) -> Updates:
        return Updates(Sheet(self._candidates, self._scale), self._free)

    def run(self, judge: Judge) -> Labelling:
        """Go on until a labelling fits, or the budget is spent, or the search is in vain; the best so far."""
        while self._waiting and not (self.best.fits or judge.spent) and self._in_vain < SEARCH.in_vain:
            value, number, labelling, changed = heapq.heappop(self._waiting)
            if changed is None:
                # The misfit, about proportional to the number of wrong labels, will not be gone falling as it has.
                falls = self._first - self._least
                if self._ranked >= SEARCH.at_least and self._ranked * self._least > SEARCH.patience * falls:
                    break
                self._seen.add(self._updates.outline(labelling.labels))
                self._ranked += 1
                judge.spend(SEARCH.ranking)
                changed = map(partial(self._turned, labelling.labels), self._updates.ranked(labelling))
            asked = 0
            for labels in islice(changed, SEARCH.batch):
                asked += 1
                if judge.spent or self._tried(labels, labelling, judge) < SEARCH.better * value:
                    break
            else:
                value += SEARCH.tried * labelling.mean_misfit
            if asked:
                heapq.heappush(self._waiting, (value, number, labelling, changed))
        _log.debug("best-first: misfit %.1e, %d labellings ranked", self.best.size, self._ranked)
        return self.best

    def _turned(self, labels: NDArray[np.bool_], move: Move) -> NDArray[np.bool_]:
        """The labels after a move; with cells on all edges, unless some cells claim no half-edges."""
        labels = turned(labels, move)
        if labels[self._n_faces :].any():
            return labels
        return chosen(self._candidates, np.where(labels, 1.0, -np.inf))

    def _tried(self, labels: NDArray[np.bool_], before: Labelling, judge: Judge) -> float:
        """The mean misfit of labels that have not been tried before."""
        outline = self._updates.outline(labels)
        if outline in self._seen or (labels != before.labels)[~self._free].any():
            return np.inf
        self._seen.add(outline)
        trial = judge(self._candidates, labels)
        self.best, value = better(self.best, trial), trial.mean_misfit
        self._in_vain = 0 if value < self._least else self._in_vain + 1
        self._least = min(value, self._least)
        if trial.pieces:
            heapq.heappush(self._waiting, (value, len(self._seen), trial, None))
        return value
