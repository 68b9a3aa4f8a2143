"""From a reading with many wrong labels to one with few, or none."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import RecoveryError
from .exchange import SETTLED, Exchange
from .fitting import Fitted, fitted
from .reading import Reading
from .relaxation import Aim, Path, central_path
from .sheet import Sheet

_NEAR = 0.95  # strength of the first labels
_PATHS = (Path(), Path(first=0.1, slack=0.01))
_HOPELESS = 0.05  # mean cost of an edge after the relaxation with which there is nothing to begin with
_NEARLY = 0.005  # mean cost with which a beam search is worth its while
_TRIALS, _TRIALS_PER_VERTEX = 6000, 10  # the lesser number is made


def mended(start: Reading) -> NDArray[np.bool_] | None:
    """Better labels than those of a reading with many wrong ones; None where none are found.

    Parameters
    ----------
    start : Reading
        Its largest piece has positions.
    """
    solved = [(piece, mesh) for piece, mesh in zip(start.pieces, start.meshes, strict=True) if mesh]
    if not solved:
        return None
    candidates = start.candidates
    unit = candidates.scale or max(solved, key=lambda item: item[0].n_vertices)[1].scale
    sheet = Sheet(candidates, unit)
    exchange = Exchange(sheet, start.labels, min(_TRIALS, _TRIALS_PER_VERTEX * sheet.n_vertices))
    best: Fitted | None = None
    for path in _PATHS:
        fit = _relaxed(sheet, start.labels, path)
        if fit and fit.cost <= _HOPELESS * len(sheet.edges):
            fit = exchange.settled(fit)
        if fit and (best is None or fit.cost < best.cost):
            best = fit
        if best and best.cost <= SETTLED:
            break
    if best is None:
        return None
    if best.cost <= _NEARLY * len(sheet.edges):
        best = exchange.settled(best, deep=True)
    taken = candidates.compatible(np.where(best.labels, 1.0, -np.inf))
    return candidates.covering(taken, candidates.belief)


def _relaxed(sheet: Sheet, labels: NDArray[np.bool_], path: Path) -> Fitted | None:
    """Whole labels at the end of a path; None where there is no map."""
    first = labels[sheet.chosen].astype(np.float64)
    strength = np.zeros(len(labels))
    strength[sheet.chosen] = np.abs(first - (1 - _NEAR))
    try:
        strength, placed = central_path(sheet, Aim(first, np.ones_like(first)), strength, None, path)
    except RecoveryError:
        return None
    return fitted(sheet, strength > 0.5, placed)
