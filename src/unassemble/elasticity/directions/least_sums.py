"""Directions with which sums are smallest, where no single row tells them.

Near an edge in which two planes of rollers meet, rows hold all entries of the third direction only, and its sums vanish
if the rows of nodes in both planes are right. All rows together do tell: with the right directions most sums
vanish, and what many zeros make least is the sum of absolute values, by a linear program. Stiffness against a change of
volume does not matter for it, as it does for directions of least energy.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.optimize import linprog

from ..rows.constants import row_sizes, with_penalty

_SMALLER = 1e-9  # share by which sums are smaller, and not by rounding
_LARGEST = 500  # rows to name beyond which it would take minutes: 100 take a second or two
_SECONDS = 20.0  # after which directions stay as they are


def named_by_least_sums(
    matrix: sp.csr_array, direction: NDArray[np.int64], unnamed: NDArray[np.bool_], d: int
) -> NDArray[np.int64]:
    """Directions of which those that are unnamed are chosen anew, if sums are smaller then; nothing proves them.

    Each unnamed row has a share of each direction, and the shares that make sums least are nearly always whole.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric.
    direction : (N,) int64
    unnamed : (N,) bool
    d : int
    """
    rows = np.flatnonzero(unnamed)
    if not 0 < len(rows) <= _LARGEST:
        return direction
    size = row_sizes(matrix)
    near = np.flatnonzero((abs(matrix) @ unnamed.astype(float) > 0) & (size > 0))
    scaled = sp.csr_array(sp.diags_array(1 / size[near]) @ matrix[near])
    given = scaled @ (np.eye(d)[direction] * ~unnamed[:, None])
    counts = np.ones((len(near), d))
    counts[np.arange(len(near)), direction[near]] = ~with_penalty(matrix, size)[near]  # whose own sums are hidden
    chosen, over = sp.kron(sp.eye_array(d), scaled[:, rows]), sp.eye_array(given.size)
    found = linprog(
        np.concatenate([np.zeros(d * len(rows)), counts.T.ravel()]),
        A_ub=sp.block_array([[chosen, -over], [-chosen, -over]]),
        b_ub=np.concatenate([-given.T.ravel(), given.T.ravel()]),
        A_eq=sp.hstack([sp.eye_array(len(rows))] * d + [sp.csr_array((len(rows), given.size))]),
        b_eq=np.ones(len(rows)),
        method="highs-ds",  # interior point steps may go on for ever where penalties leave rows of very different size
        options={"time_limit": _SECONDS},
    )
    if found.x is None:
        return direction
    named = direction.copy()
    named[rows] = found.x[: d * len(rows)].reshape(d, -1).argmax(axis=0)
    before, after = ((np.abs(scaled @ np.eye(d)[some]) * counts).sum() for some in (direction, named))
    return named if after < (1 - _SMALLER) * before else direction
