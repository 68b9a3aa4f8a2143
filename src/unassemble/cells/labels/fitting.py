"""Positions for whole labels that leave as few weights unexplained as possible.

What a wrong cell does to the weights around it cannot be explained. A least-squares fit would spread it over the mesh;
this one minimises sum_e phi(r_e), phi(r) = (r^2 + h^2)^(1/2) - h, nearly the sum of |r_e|, and leaves it where it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...errors import SolverError
from ...linalg import solved
from .sheet import Placed, Sheet, unpinned

SMOOTH = 0.02
"""h: misfits below count by their squares."""
_STEPS = (1.0, 0.3, 0.1)
_DAMPING, _LEAST_DAMPING = 1e-4, 1e-7
_PROGRESS = 1e-4
_HELD = 1e-9


def cost(misfit: NDArray) -> NDArray[np.float64]:
    """phi of each misfit."""
    return np.asarray(np.sqrt(misfit * misfit + SMOOTH**2) - SMOOTH)


@dataclass(frozen=True, eq=False)
class Fitted:
    """Whole labels and positions for them.

    Attributes
    ----------
    labels : (cells,) bool
    placed : Placed
    misfit : (e,) float64
    """

    labels: NDArray[np.bool_]
    placed: Placed
    misfit: NDArray[np.float64]

    @classmethod
    def of(cls, sheet: Sheet, labels: NDArray[np.bool_], placed: Placed) -> Fitted:
        """Positions as they are."""
        return cls(labels, placed, sheet.misfit(placed, labels.astype(np.float64)))

    @property
    def cost(self) -> float:
        """Sum of phi over the edges."""
        return float(cost(self.misfit).sum())


def fitted(sheet: Sheet, labels: NDArray[np.bool_], placed: Placed, steps: int = 10) -> Fitted:
    """Improve positions for given labels by reweighted, damped Gauss-Newton steps."""
    strength = labels.astype(np.float64)
    best = Fitted.of(sheet, labels, placed)
    damping = _DAMPING
    for _ in range(steps):
        trial = _lowered(sheet, best, strength, damping)
        if trial is None:
            damping *= 100
            if damping > 1:
                break
            continue
        done = best.cost - trial.cost < _PROGRESS * best.cost
        best, damping = trial, max(damping / 10, _LEAST_DAMPING)
        if done:
            break
    return best


def _lowered(sheet: Sheet, fit: Fitted, strength: NDArray, damping: float) -> Fitted | None:
    by_position, _, by_scale = sheet.linearised(fit.placed, strength)
    free = unpinned(fit.placed.z)
    columns = sp.hstack([by_position[:, free], sp.csr_array(by_scale[:, None])]).tocsr()
    weight = 1 / (cost(fit.misfit) + SMOOTH)
    held = np.append(damping * np.repeat(sheet.extent(fit.placed.z) ** -2, 2)[free], _HELD if sheet.free_scale else 1.0)
    try:
        step = solved(
            (columns.T @ sp.diags_array(weight) @ columns + sp.diags_array(held)).tocsr(),
            columns.T @ (weight * fit.misfit),
        )
    except SolverError:
        return None
    d = np.zeros(2 * len(fit.placed.z))
    d[free] = step[:-1]
    for factor in _STEPS:
        placed = sheet.moved(fit.placed, d.view(np.complex128), float(step[-1]), factor)
        trial = Fitted(fit.labels, placed, sheet.misfit(placed, strength))
        if trial.cost < fit.cost:
            return trial
    return None
