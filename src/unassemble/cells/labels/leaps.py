"""All labels that the linear explanation of a misfit asks to turn over, see :mod:`unassemble.cells.labels.evidence`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..candidates.choosing import chosen
from ..reading import Reading
from .evidence import label_changes

_CLEAR = 0.35  # a label that is to change by so much is turned over
_HOPELESS = -0.3  # belief in a corner at a vertex that does not look like an inner one


def clear_changes(reading: Reading) -> NDArray[np.bool_]:
    """(cells,) labels with all clear changes made; as they are where there are none."""
    changes = np.nan_to_num(label_changes(reading))
    gain = np.where(reading.labels, -changes, changes)
    top = float(gain.max(initial=0.0))
    if top <= 0:
        return reading.labels
    return _turned(reading, changes, gain >= (max(_CLEAR, 0.6 * top) if top > _CLEAR else 0.7 * top))


def _turned(reading: Reading, changes: NDArray, turned: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The labels with some turned over; what stands in the way of a new cell goes, bare edges get a cell again."""
    candidates, labels = reading.candidates, reading.labels
    value = np.where(labels, 1.0, -np.inf)
    value[turned] = np.where(labels[turned], -np.inf, 2.0 + changes[turned])
    fallback = np.where(changes != 0, labels + changes, candidates.belief) - 10.0 * (turned & labels)
    # A cell is rather kept than replaced by a corner that can be none.
    fallback[candidates.corner & (candidates.belief < _HOPELESS)] -= 20.0
    return chosen(candidates, value, fallback)
