"""Directions with which sums are smallest, where no single row tells them.

Translations are not in equilibrium next to supports, and rows next to edges in which planes of rollers meet hold all
entries of one direction only. All rows together do tell: with the right directions most sums vanish, and what many
zeros make least is the sum of absolute values. Stiffness against a change of volume does not matter for it.

References
----------
Pock and Chambolle, "Diagonal preconditioning for first order primal-dual algorithms in convex optimization", ICCV 2011.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import Budget
from ..tolerances import CANCELLED
from .constants import proven_directions, row_sizes, without_penalties
from .equilibrium import spread_directions

_STEPS = 1000  # of the primal-dual method: a third of them names the same rows, three times as many no more


def with_least_sums(
    matrix: sp.csr_array, group: NDArray[np.int64], direction: NDArray[np.int64], d: int, budget: Budget
) -> NDArray[np.int64]:
    """Choose the directions that no sum proves such that all sums together are least, until none changes.

    They start from those given, and from those with which translations are in equilibrium where the others are proven.
    Rows of one `group` couple to the same unknowns. Where the budget does not suffice, directions stay as they are.
    """
    told, size = without_penalties(matrix), row_sizes(matrix)
    scaled = sp.csr_array(sp.diags_array(1 / np.where(size > 0, size, np.inf)) @ told)

    def total(one: NDArray[np.int64]) -> float:
        return float(np.abs(scaled @ np.eye(d)[one]).sum())

    while True:
        unnamed = ~proven_directions(matrix, direction, group, d)
        if not unnamed.any() or unnamed.all():  # if all rows had one direction, sums would be least
            break
        other = spread_directions(matrix, group, d, np.where(unnamed, -1, direction))
        trials = [_named(scaled, one, unnamed, d, budget) for one in (direction, other)]
        best = min([other, *trials], key=total)
        if total(best) >= (1 - CANCELLED) * total(direction):
            break
        direction = best
    return direction


def _named(
    scaled: sp.csr_array, direction: NDArray[np.int64], unnamed: NDArray[np.bool_], d: int, budget: Budget
) -> NDArray[np.int64]:
    """Directions of which those of unnamed rows, (N,), were chosen anew, rows of the matrix `scaled` to size one.

    Each unnamed row has a share of each direction, and the shares that make sums least are nearly always whole.
    """
    rows = np.flatnonzero(unnamed)
    near = np.flatnonzero(abs(scaled) @ unnamed.astype(float) > 0)
    chosen = sp.csr_array(scaled[near][:, rows])
    if not budget.take(2.0 * _STEPS * d * chosen.nnz):
        return direction
    given = scaled[near] @ (np.eye(d)[direction] * ~unnamed[:, None])
    named = direction.copy()
    named[rows] = _least(chosen, given, direction[rows]).argmax(axis=1)
    return named


def _least(matrix: sp.csr_array, given: NDArray[np.float64], direction: NDArray[np.int64]) -> NDArray[np.float64]:
    """(n, d) shares for which the sum of ``|matrix @ shares + given|``, (m, d), is nearly least.

    Each row of shares adds up to one. Found by a primal-dual method from directions (n,); see Pock and Chambolle.
    """
    size, back = abs(matrix), sp.csr_array(matrix.T)
    ahead = 1 / np.maximum(np.asarray(size.sum(axis=0)).ravel(), np.finfo(float).tiny)[:, None]
    behind = 1 / np.maximum(np.asarray(size.sum(axis=1)).ravel(), np.finfo(float).tiny)[:, None]
    share = extrapolated = np.eye(given.shape[1])[direction]
    dual = np.zeros_like(given)
    for _ in range(_STEPS):
        dual = np.clip(dual + behind * (matrix @ extrapolated + given), -1, 1)
        before, share = share, _in_simplex(share - ahead * (back @ dual))
        extrapolated = 2 * share - before
    return share


def _in_simplex(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """The nearest rows that add up to one and are nowhere negative (Held, Wolfe and Crowder, 1974)."""
    ordered = np.sort(x, axis=1)[:, ::-1]
    excess = (np.cumsum(ordered, axis=1) - 1) / np.arange(1, x.shape[1] + 1)
    last = (ordered > excess).sum(axis=1) - 1
    return np.maximum(x - excess[np.arange(len(x)), last][:, None], 0)
