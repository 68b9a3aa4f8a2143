"""Labels between 0 and 1: many wrong ones put right at once.

There are more candidates than conditions, and many fractional labels explain the matrix. As wrong labels are few, the
least change in the sense of sum_k |s_k - s0_k| is sought, subject to the weights: linearised at the right mesh, this
linear program has whole labels as its solution. Positions are not known yet, so they and the labels are improved
together, along the central path of a logarithmic barrier t:

    minimise  sum_k |s_k - s0_k| - t sum_k log s_k (1 - s_k) + 1/(2 q) |r - J d - g w - B ds|^2,

one Newton step for each t, q falling with t. The path commits itself to whole labels as late as possible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...errors import RecoveryError
from ...linalg import solved
from .sheet import Placed, Sheet, unpinned

_HELD = 1e-9  # keeps the problem definite where labels of zero leave vertices free
_NEAREST = 0.1  # of the way to 0 or 1 that one step leaves
_NEAR = 0.95  # strength of the first labels


@dataclass(frozen=True)
class Path:
    """From one barrier to another.

    Attributes
    ----------
    first, last, factor : float
        Barriers t, and the ratio of one to the one before.
    slack : float
        q at the first barrier.
    mapped_above : float
        Barriers above which positions are those of the conformal map; from there on they move with the labels.
    outlier : float
        Misfit beyond which an edge counts by its misfit, not by the square.
    """

    first: float = 0.3
    last: float = 1e-3
    factor: float = 0.75
    slack: float = 0.03
    mapped_above: float = 1e-3
    outlier: float = 0.3


def relaxed(sheet: Sheet, free: NDArray[np.bool_], path: Path) -> NDArray[np.bool_] | None:
    """Whole labels at the end of a path that begins with all chosen candidates as cells.

    Parameters
    ----------
    sheet : Sheet
    free : (k,) bool
        Which of the chosen candidates may be holes; the others are known cells.
    path : Path

    Returns
    -------
    (cells,) bool or None
        None where there is no conformal map on the way, or an equation is singular.
    """
    strength = np.zeros(sheet.candidates.count)
    strength[sheet.chosen] = np.where(free, _NEAR, 1.0)
    changing, t, placed = np.flatnonzero(sheet.chosen)[free], path.first, None
    try:
        while t > path.last:
            if placed is None or t > path.mapped_above:
                placed = sheet.mapped(strength, placed)
            new, d, log_scale = _step(sheet, placed, strength, free, t, path)
            if t <= path.mapped_above:
                length = float((np.abs(d) / sheet.extent(placed.z)).max())
                placed = sheet.moved(placed, d, log_scale, 1 / max(length, 1.0))
            strength[changing] = new
            t *= path.factor
    except RecoveryError:
        return None
    return strength > 0.5


def _step(
    sheet: Sheet, placed: Placed, strength: NDArray, may_change: NDArray[np.bool_], t: float, path: Path
) -> tuple[NDArray, NDArray, float]:
    """New strengths of the candidates that may change, displacements and the change of log c."""
    s = strength[sheet.chosen][may_change]
    by_position, by_label, by_scale = sheet.linearised(placed, strength)
    free = unpinned(placed.z)
    moving, k = int(free.sum()), len(s)
    columns = sp.hstack(
        [by_position[:, free], by_label[:, np.flatnonzero(may_change)], sp.csr_array(by_scale[:, None])]
    )
    misfit, slack = sheet.misfit(placed, strength), path.slack * t / path.first
    with np.errstate(divide="ignore"):
        weighted = columns.T @ sp.diags_array(np.minimum(path.outlier / np.abs(misfit), 1.0) / slack)
    held = np.full(moving + k + 1, _HELD / slack)
    held[-1] += 0.0 if sheet.free_scale else 1.0
    held[moving : moving + k] = t / s**2 + t / (1 - s) ** 2
    rhs = weighted @ misfit
    rhs[moving : moving + k] += 1.0 + t / s - t / (1 - s)  # labels are drawn to 1
    step = solved((weighted @ columns + sp.diags_array(held)).tocsr(), rhs)
    new = np.clip(s + step[moving : moving + k], _NEAREST * s, 1 - _NEAREST * (1 - s))
    d = np.zeros(2 * len(placed.z))
    d[free] = step[:moving]
    return new, d.view(np.complex128), float(step[-1])
