"""Many labels turned over at once: those whose change explains the misfit best, to first order.

With label s_k of each candidate the weights are w_e = 1/2 sum_k s_k cot_ke. At a map of some labels the misfit r is
explained to first order by displacements d of the vertices, a change g of log c and changes ds of the labels:

    minimise  | r - J d - g w - B ds |^2 + ridge^2 | ds |^2,        B_ek = 1/2 cot_ke.

Displacements spread the misfit over the mesh, so that the largest residuals need not surround the wrong cell; the
labels that take part in the best explanation do.
"""

import numpy as np
from numpy.typing import NDArray

from ...errors import RecoveryError
from ..candidates.choosing import chosen
from ..judge.labelling import Labelling
from ..relax.sheet import Sheet
from .best_first import Judge, better
from .options import SEARCH

_RIDGE = 0.1
_CLEAR = 0.35
"""A label that is to change by so much is turned over."""


def leapt(start: Labelling, judge: Judge) -> Labelling:
    """The best of what all clear changes at once lead to, uphill too: with many wrong cells the misfit is no guide."""
    best = labelling = start
    sheet, seen = Sheet(start.candidates, start.scale), {start.labels.tobytes()}
    for _ in range(SEARCH.leaps):
        judge.spend(SEARCH.leaping)
        labels = _leap(sheet, labelling.labels)
        if labelling.fits or judge.spent or labels.tobytes() in seen:
            break
        seen.add(labels.tobytes())
        labelling = judge(start.candidates, labels)
        best = better(best, labelling)
    return best


def _leap(sheet: Sheet, labels: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(cells,) labels with all clear changes made; as they are where there is no map."""
    strength, may_change = labels.astype(np.float64), np.flatnonzero(sheet.chosen)
    try:
        trust, held = np.ones(len(sheet.weights)), np.full(len(may_change), _RIDGE**2)
        step = sheet.label_step(sheet.mapped(strength), strength, may_change, trust, held, 0.0)
    except RecoveryError:
        return labels
    changes = np.zeros(len(labels))
    changes[may_change] = np.nan_to_num(step)
    gain = np.where(labels, -changes, changes)
    top = float(gain.max(initial=0.0))
    if top <= 0:
        return labels
    turned = gain >= (max(_CLEAR, 0.6 * top) if top > _CLEAR else 0.7 * top)
    value = np.where(labels, 1.0, -np.inf)
    value[turned] = np.where(labels[turned], -np.inf, 2.0 + changes[turned])
    return chosen(sheet.candidates, value, labels + changes - 10.0 * (turned & labels))
