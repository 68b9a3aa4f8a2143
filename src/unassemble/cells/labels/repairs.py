"""Labels turned over as the misfit asks for it: many at once, then few."""

from __future__ import annotations

import logging

import numpy as np

from ..reading import Reading
from .descent import Descent, better
from .effort import Effort
from .leaps import clear_changes

_log = logging.getLogger(__name__)

_HALF = 0.5
_PATIENCE = 6  # leaps without an improvement; fewer where they are long


def repaired(reading: Reading, effort: Effort) -> Reading:
    """Turn labels over as the misfit asks for it."""
    best = _leaps(reading, effort)
    return best if best.fits else Descent(best).run(effort)


def leapt(reading: Reading, effort: Effort) -> Reading:
    """Turn over all labels that the misfit is clear about, and once more as long as that takes half of it away."""
    best = reading
    while best.pieces and not best.fits and not effort.spent:
        trial = effort.reading(best.candidates, clear_changes(best))
        if not trial.size < _HALF * best.size:
            break
        best = trial
    return best


def _leaps(reading: Reading, effort: Effort) -> Reading:
    """All clear changes at once, uphill too: with many wrong cells the misfit of the way is no guide."""
    best, since_best, progress = reading, 0, effort.progress(reading, _PATIENCE)
    patience = np.clip(3e4 / reading.candidates.n_vertices, 2, _PATIENCE)
    seen = {reading.labels.tobytes()}
    while reading.pieces and not reading.fits and since_best < patience and progress.suffices(best.size):
        labels = clear_changes(reading)
        if labels.tobytes() in seen:
            break
        seen.add(labels.tobytes())
        reading = effort.reading(reading.candidates, labels)
        since_best = 0 if reading.size < best.size else since_best + 1
        best = better(best, reading)
        _log.debug("leap: misfit %.1e", reading.size)
    return best
