"""From a reading with many wrong labels to one with few, or none."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from ...errors import RecoveryError
from ...planar.piece import PieceMesh
from ..candidates.candidates import Candidates
from ..candidates.redrawing import redrawings
from ..reading import Reading
from .effort import Effort
from .exchange import NEARLY, SETTLED, Exchange, whole
from .fitting import Fitted, cost, fitted
from .relaxation import HOPELESS, Aim, HopelessError, Path, central_path
from .sheet import Placed, Sheet

MOST_VERTICES = 20_000
"""Up to which labels are relaxed and exchanged."""
_WIDE = 20  # vertices of the largest piece for which it is worth its while
_SOLVES = 20  # that this is worth
_SOUND = 0.5  # cost, relative to the hopeless one, of labels to go on with where paths are hopeless
_NEAR = 0.95  # strength of the first labels
_SHORT = Path(first=0.1, slack=0.01)
_TRIALS, _TRIALS_PER_VERTEX = 6000, 10  # the lesser number is made: some twenty times what relaxations cost
_DEAREST, _STEEP, _CHEAPEST = 1.5, 4.0, 0.3  # price of a change: with angles that add up to pi, its fall, and the least


def mended(start: Reading, effort: Effort) -> Reading | None:
    """A reading with fewer wrong labels than one with many, maybe in another drawing.

    None where none is found, the graph is too large, or so small that trying labels one by one is as good.

    Raises
    ------
    HopelessError
        If not even labels between 0 and 1 come near the weights.
    """
    widest = max((piece.n_vertices for piece in start.pieces), default=0)
    if widest < _WIDE or start.candidates.n_vertices > MOST_VERTICES:
        return None
    effort.solves -= _SOLVES
    found = _mended_labels(start, effort.known)
    return None if found is None else effort.reading(*found)


def _mended_labels(start: Reading, known: dict[bytes, PieceMesh | None]) -> tuple[Candidates, NDArray[np.bool_]] | None:
    solved = [(piece, mesh) for piece, mesh in zip(start.pieces, start.meshes, strict=True) if mesh]
    if not solved:
        return None
    unit = start.candidates.scale or max(solved, key=lambda item: item[0].n_vertices)[1].scale
    sheet = Sheet(start.candidates, unit)
    relaxed = _relaxations(sheet, start.labels)
    if not relaxed:
        return None
    best = relaxed[0]
    trials = min(_TRIALS, _TRIALS_PER_VERTEX * sheet.n_vertices)
    exchange = Exchange(sheet, start.labels, trials, known)
    for fit in relaxed:
        if exchange.answer is None and best.cost > SETTLED and fit.cost <= HOPELESS * len(sheet.edges):
            best = min(best, exchange.settled(fit), key=lambda either: either.cost)
    if exchange.answer is None and best.cost <= NEARLY * len(sheet.edges):
        again, best = _redrawn(exchange, best)
        # In a drawing that fits better there is more to gain.
        again.left = again.left + trials // 2 if again is not exchange else min(again.left, trials // 4)
        exchange, best = again, again.settled(best, deep=True)
    candidates = exchange.sheet.candidates
    return candidates, whole(candidates, best.labels) if exchange.answer is None else exchange.answer


def _relaxations(sheet: Sheet, labels: NDArray[np.bool_]) -> list[Fitted]:
    """Whole labels at the end of some paths, the best first.

    Where a path ends depends on little things, and it costs a fraction of what trying labels one by one does: it is
    worth while to have the choice.
    """
    first = labels[sheet.chosen].astype(np.float64)
    even = np.ones_like(first)
    believed = Aim(first, _prices(sheet, labels))
    found: list[Fitted] = []
    for aim, path in ((believed, Path()), (Aim(first, even), Path()), (Aim(first, even), _SHORT)):
        try:
            fit = relaxed(sheet, aim, path)
            if fit is not None and fit.cost > HOPELESS * len(sheet.edges) and not found:
                raise HopelessError
        except HopelessError:
            if not found:
                return [_unrelaxed(sheet, labels)]
            break
        if fit is None:
            break
        found.append(fit)
        if fit.cost <= NEARLY * len(sheet.edges):
            break
    return sorted(found, key=lambda fit: fit.cost)


def _unrelaxed(sheet: Sheet, labels: NDArray[np.bool_]) -> Fitted:
    """The labels themselves, which may be better than where paths lead."""
    try:
        fit = fitted(sheet, labels, sheet.mapped(labels.astype(np.float64)))
    except RecoveryError as error:
        raise HopelessError from error
    if fit.cost > _SOUND * HOPELESS * len(sheet.edges):
        raise HopelessError
    return fit


def _prices(sheet: Sheet, labels: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(k,) of a change of the labels of the chosen candidates: what triangle has the angles of a hole is cheap."""
    candidates = sheet.candidates
    excess = 1 - candidates.belief
    told = labels & (candidates.size == 3) & ~candidates.corner
    return np.asarray(np.where(told, np.maximum(_DEAREST - _STEEP * excess, _CHEAPEST), 1.0)[sheet.chosen])


def _redrawn(exchange: Exchange, fit: Fitted) -> tuple[Exchange, Fitted]:
    """The same labels in other drawings, as long as that makes them better."""
    better = True
    while better and exchange.answer is None and _faults(exchange.sheet, fit) > SETTLED:
        better = False
        sheet = exchange.sheet
        for other in redrawings(sheet.candidates, _faults_at(sheet, fit)):
            usual = other.carried(exchange.usual)
            trials = Exchange(Sheet(other.candidates, sheet.unit), usual, exchange.left, exchange.known)
            trial = trials.settled(_carried(trials.sheet, other.carried(fit.labels), fit.placed))
            exchange.left = trials.left
            if trials.answer is not None or _faults(trials.sheet, trial) < _faults(sheet, fit):
                exchange, fit, better = trials, trial, True
                break
    return exchange, fit


def _faults(sheet: Sheet, fit: Fitted) -> float:
    """The cost; a cell that can be none counts as much as an edge that nothing explains."""
    return fit.cost + float((fit.labels & sheet.candidates.chorded).sum())


def _faults_at(sheet: Sheet, fit: Fitted) -> NDArray[np.float64]:
    """(n,) the same by vertices."""
    candidates = sheet.candidates
    at_vertex = np.bincount(sheet.edges.ravel(), np.repeat(cost(fit.misfit), 2), sheet.n_vertices)
    wrong = np.repeat(fit.labels & candidates.chorded, candidates.size)
    return np.asarray(at_vertex + np.bincount(candidates.cells.vertices[wrong], minlength=sheet.n_vertices))


def _carried(sheet: Sheet, labels: NDArray[np.bool_], placed: Placed) -> Fitted:
    """Labels with positions that were those of nearly the same ones, in a drawing that may be mirrored."""
    mirrored = Placed(np.conj(placed.z), placed.c)
    placed = min((placed, mirrored), key=lambda either: Fitted.of(sheet, labels, either).cost)
    with suppress(RecoveryError):
        placed = sheet.mapped(labels.astype(np.float64), placed)
    return fitted(sheet, labels, placed)


def relaxed(sheet: Sheet, aim: Aim, path: Path) -> Fitted | None:
    """Whole labels at the end of a path from near those that it aims at; None where there is no map.

    Raises
    ------
    HopelessError
        If not even labels between 0 and 1 come near the weights.
    """
    strength = np.zeros(sheet.candidates.count)
    strength[sheet.chosen] = np.where(aim.free, np.abs(aim.labels - (1 - _NEAR)), aim.labels)
    try:
        strength, placed = central_path(sheet, aim, strength, None, path)
    except RecoveryError:
        return None
    return fitted(sheet, strength > 0.5, placed)
