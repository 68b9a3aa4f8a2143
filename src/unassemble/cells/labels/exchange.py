"""The last wrong labels, cluster by cluster.

Where most labels are right the others lie in small clusters, often a hole and a cell that have changed places, and
the misfit of :mod:`unassemble.cells.labels.fitting` stays near them. Labels there are turned over, one, two, or up to
four at a time, and tried in their neighbourhood; where that ends, the labels around the misfit are made fractional
again.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...errors import RecoveryError
from ...planar.piece import PieceMesh
from ..candidates.candidates import Candidates
from ..candidates.choosing import chosen
from ..reading import Reading
from .fitting import Fitted, cost, fitted
from .neighbourhood import Neighbourhoods, Trial, adjacent_to
from .reopening import REOPENINGS, reopened
from .sheet import Placed, Sheet

_log = logging.getLogger(__name__)

SETTLED = 1e-5
"""Cost of labels that explain everything."""
NEARLY = 0.005
"""Mean cost of an edge where few labels are wrong."""
_SUSPECTS = 60  # cells, or this part of all of them, that are turned over in a round
_SHARE = 0.05
_FAINT = 0.1  # misfit about a suspect, relative to the largest, below which it waits for a later round
_CLEAR = 0.3  # gain, relative to the best, of what is turned over along with it
_PLACES, _BREADTH, _DEPTH = 3, 24, 4  # of the beam search: edges about which, sets kept, and labels in one
_QUICK = 0.9  # cost, relative to the former one, after a round that is followed by another of the same kind


def whole(candidates: Candidates, labels: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A reading of the graph: no two cells on one half-edge, and cells on all edges."""
    return chosen(candidates, np.where(labels, 1.0, -np.inf))


class Exchange:
    """Turns labels over until none are wrong, or no change helps.

    Parameters
    ----------
    sheet : Sheet
    usual : (cells,) bool
        Labels to which reopened ones are drawn.
    trials : int
        How many may be made.
    known : dict
        Pieces that have been solved, see :class:`~unassemble.cells.reading.Reading`.

    Attributes
    ----------
    answer : (cells,) bool or None
        Labels that fit when every piece is solved by itself. Pieces that share vertices only may lie in wrong places
        when few labels are wrong, or none, and then cost something.
    """

    def __init__(
        self, sheet: Sheet, usual: NDArray[np.bool_], trials: int, known: dict[bytes, PieceMesh | None] | None = None
    ):
        self.sheet = sheet
        self.usual = usual
        self.left = trials
        self.known = {} if known is None else known
        self.answer: NDArray[np.bool_] | None = None
        self._near = Neighbourhoods(sheet)
        self._seen: set[bytes] = set()

    def settled(self, fit: Fitted, *, deep: bool = False) -> Fitted:
        """The labels that explain most; with a beam search, if `deep`, where nothing else helps."""
        moves: list[Callable[[Fitted], Fitted]] = [
            *(partial(reopened, self.sheet, self._near, self.usual, how) for how in REOPENINGS),
            self._redrawn,
        ]
        if deep:
            moves.append(self._deep)
        begun = fit.cost, self.left
        fit, turn = self._rounds(fit, begun), 0
        while not self._done(fit) and turn < len(moves) and self._suffices(fit, begun):
            other = self._rounds(moves[turn](fit), begun)
            _log.debug("cost %.3g, then %.3g, %d trials left", fit.cost, other.cost, self.left)
            turn = 0 if other.cost < _QUICK * fit.cost else turn + 1
            fit = min(fit, other, key=lambda either: either.cost)
        return fit

    def _done(self, fit: Fitted) -> bool:
        """Whether the labels are an answer; asked once for each that leave little."""
        if (
            self.answer is None
            and fit.cost <= NEARLY * len(self.sheet.edges)
            and fit.labels.tobytes() not in self._seen
        ):
            self._seen.add(fit.labels.tobytes())
            labels = whole(self.sheet.candidates, fit.labels)
            if Reading.of(self.sheet.candidates, labels, self.known).fits:
                self.answer = labels
        return self.answer is not None or fit.cost <= SETTLED

    def _suffices(self, fit: Fitted, begun: tuple[float, int]) -> bool:
        """Whether the trials that are left would do if the cost went on falling as it has since it was `begun` with.

        Where little is left to do a single label may make the difference.
        """
        cost_then, left_then = begun
        if fit.cost <= NEARLY * len(self.sheet.edges):
            return self.left > 0
        return (cost_then - fit.cost) * self.left > fit.cost * (left_then - self.left)

    def _rounds(self, fit: Fitted, begun: tuple[float, int]) -> Fitted:
        while not self._done(fit) and self.left > 0:
            other = self._pairs(fit)
            slow = not other.cost < _QUICK * fit.cost
            _log.debug("round: cost %.3g, then %.3g, %d trials left", fit.cost, other.cost, self.left)
            fit = other
            if slow or not self._suffices(fit, begun):
                break
        return fit

    def _pairs(self, fit: Fitted) -> Fitted:
        """Single labels, and pairs of a cell and a hole that touch, in the places of greatest misfit."""
        suspects = self._suspects(fit)
        touching = self._near.touching
        pairs: set[tuple[int, ...]] = {(k,) for k in suspects}
        for k in suspects:
            others = touching.indices[touching.indptr[k] : touching.indptr[k + 1]]
            pairs.update((min(k, j), max(k, j)) for j in others.tolist() if fit.labels[j] != fit.labels[k])
        return self._taken(fit, self._tried(fit, sorted(pairs)))

    def _suspects(self, fit: Fitted) -> list[int]:
        sheet = self.sheet
        at_vertex = np.bincount(sheet.edges.ravel(), np.repeat(cost(fit.misfit), 2), sheet.n_vertices)
        score = np.bincount(np.repeat(sheet.cell, 3), at_vertex[sheet.triangles].ravel(), sheet.candidates.count)
        most = max(_SUSPECTS, int(_SHARE * sheet.chosen.sum()))
        order = np.argsort(-score, kind="stable")[:most]
        return [int(k) for k in order[sheet.chosen[order] & (score[order] > _FAINT * score.max())]]

    def _tried(self, fit: Fitted, moves: Iterable[tuple[int, ...]], *, wide: bool = False) -> list[Trial]:
        """All moves, the best first."""
        trials = []
        for cells in dict.fromkeys(self._near.with_rivals(fit.labels, cells) for cells in moves):
            if self.left <= 0:
                break
            self.left -= 1
            trials.append(self._near.trial(fit, cells, rings=2 if wide else 1, redrawn=wide))
        return sorted(trials, key=lambda trial: -trial.gain)

    def _taken(self, fit: Fitted, trials: list[Trial]) -> Fitted:
        """The best trials that do not touch each other, all together; or the best one alone."""
        if not trials or trials[0].gain <= 0:
            return fit
        least = _CLEAR * trials[0].gain
        together: list[Trial] = []
        used = np.zeros(self.sheet.n_vertices, dtype=bool)
        for trial in trials:
            if (trial.gain >= least or not together) and not used[trial.vertices].any():
                used[trial.vertices] = True
                together.append(trial)
        for some in (together, together[:1]):
            labels, z = fit.labels.copy(), fit.placed.z.copy()
            for trial in some:
                labels[list(trial.cells)] ^= True
                z[trial.vertices] = trial.z
            other = fitted(self.sheet, labels, Placed(z, fit.placed.c))
            if other.cost < fit.cost:
                return other
        return fit

    def _redrawn(self, fit: Fitted) -> Fitted:
        """The same labels, fitted from the conformal map: a fit may be caught where a triangle is flat."""
        try:
            placed = self.sheet.mapped(fit.labels.astype(np.float64), fit.placed)
        except RecoveryError:
            return fit
        other = fitted(self.sheet, fit.labels, placed)
        return other if other.cost < fit.cost else fit

    def _deep(self, fit: Fitted) -> Fitted:
        """Up to four labels at once about the worst edges, by beam search."""
        best = []
        for cells in self._places(fit):
            found: list[Trial] = []
            level: list[tuple[int, ...]] = [()]
            for _ in range(_DEPTH):
                moves = sorted({tuple(sorted((*base, k))) for base in level for k in cells if k not in base})
                trials = self._tried(fit, moves, wide=True)
                found += trials[:1]
                level = [trial.cells for trial in trials[:_BREADTH]]
            best += sorted(found, key=lambda trial: -trial.gain)[:1]
        return self._taken(fit, sorted(best, key=lambda trial: -trial.gain))

    def _places(self, fit: Fitted) -> list[list[int]]:
        """Candidates about the worst edges, each place once."""
        sheet, near = self.sheet, self._near
        used = np.zeros(sheet.n_vertices, dtype=bool)
        places: list[list[int]] = []
        for e in np.argsort(-np.abs(fit.misfit)).tolist():
            if len(places) == _PLACES:
                break
            if used[sheet.edges[e]].any():
                continue
            corners = np.unique(sheet.triangles[adjacent_to(near.facing_edge, np.array([e]))])
            around = adjacent_to(near.around_vertex, corners)
            used[sheet.triangles[around]] = True
            if len(around):  # no candidate may have the edge
                places.append(np.unique(sheet.cell[around]).tolist())
        return places
