"""Directions with which sums are smallest, where no single row tells them.

Near an edge in which two planes of rollers meet, rows hold all entries of the third direction only, and its sums vanish
if the rows of nodes in both planes are right. All rows together do tell: with the right directions most sums
vanish, and what many zeros make least is the sum of absolute values, by a linear program. Stiffness against a change of
volume does not matter for it, as it does for directions of least energy.

References
----------
Pock and Chambolle, "Diagonal preconditioning for first order primal-dual algorithms in convex optimization", ICCV 2011.
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
_STEPS = 1000  # a third of them names the same rows right, three times as many no more
_LARGEST_NEARLY = 20_000  # rows to name beyond which these would take minutes


def named_by_least_sums(
    matrix: sp.csr_array,
    direction: NDArray[np.int64],
    unnamed: NDArray[np.bool_],
    d: int,
    *,
    exactly: bool = True,
) -> NDArray[np.int64]:
    """Directions of which those that are unnamed are chosen anew, if sums are smaller then; nothing proves them.

    Each unnamed row has a share of each direction, and the shares that make sums least are nearly always whole. Where
    many rows are to be named and what is left wrong is set right later, sums that are nearly least will do.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric.
    direction : (N,) int64
    unnamed : (N,) bool
    d : int
    exactly : bool
        Whether to solve the linear program, or only to come near to its solution, in far less time.
    """
    rows = np.flatnonzero(unnamed)
    if not 0 < len(rows) <= (_LARGEST if exactly else _LARGEST_NEARLY):
        return direction
    size = row_sizes(matrix)
    near = np.flatnonzero((abs(matrix) @ unnamed.astype(float) > 0) & (size > 0))
    scaled = sp.csr_array(sp.diags_array(1 / size[near]) @ matrix[near])
    given = scaled @ (np.eye(d)[direction] * ~unnamed[:, None])
    counts = np.ones((len(near), d))
    counts[np.arange(len(near)), direction[near]] = ~with_penalty(matrix, size)[near]  # whose own sums are hidden
    chosen = sp.csr_array(scaled[:, rows])
    shares = _least(chosen, given, counts) if exactly else _nearly_least(chosen, given, counts, direction[rows])
    if shares is None:
        return direction
    named = direction.copy()
    named[rows] = shares.argmax(axis=1)
    before, after = ((np.abs(scaled @ np.eye(d)[some]) * counts).sum() for some in (direction, named))
    return named if after < (1 - _SMALLER) * before else direction


def _least(matrix: sp.csr_array, given: NDArray[np.float64], weight: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """(n, d) shares, each row of which adds up to one, for which ``|matrix @ shares + given|`` weighs least."""
    n, d = matrix.shape[1], given.shape[1]
    chosen, over = sp.kron(sp.eye_array(d), matrix), sp.eye_array(given.size)
    found = linprog(
        np.concatenate([np.zeros(d * n), weight.T.ravel()]),
        A_ub=sp.block_array([[chosen, -over], [-chosen, -over]]),
        b_ub=np.concatenate([-given.T.ravel(), given.T.ravel()]),
        A_eq=sp.hstack([sp.eye_array(n)] * d + [sp.csr_array((n, given.size))]),
        b_eq=np.ones(n),
        method="highs-ds",  # interior point steps may go on for ever where penalties leave rows of very different size
        options={"time_limit": _SECONDS},
    )
    return None if found.x is None else found.x[: d * n].reshape(d, n).T


def _nearly_least(
    matrix: sp.csr_array, given: NDArray[np.float64], weight: NDArray[np.float64], direction: NDArray[np.int64]
) -> NDArray[np.float64]:
    """The same after some steps of a primal-dual method from directions (n,); see Pock and Chambolle (2011)."""
    size, back = abs(matrix), sp.csr_array(matrix.T)
    ahead = 1 / np.maximum(np.asarray(size.sum(axis=0)).ravel(), np.finfo(float).tiny)[:, None]
    behind = 1 / np.maximum(np.asarray(size.sum(axis=1)).ravel(), np.finfo(float).tiny)[:, None]
    share = extrapolated = np.eye(given.shape[1])[direction]
    dual = np.zeros_like(given)
    for _ in range(_STEPS):
        dual = np.clip(dual + behind * (matrix @ extrapolated + given), -weight, weight)
        before, share = share, _in_simplex(share - ahead * (back @ dual))
        extrapolated = 2 * share - before
    return share


def _in_simplex(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """The nearest rows that add up to one and are nowhere negative (Held, Wolfe and Crowder, 1974)."""
    d = x.shape[1]
    ordered = np.sort(x, axis=1)[:, ::-1]
    excess = (np.cumsum(ordered, axis=1) - 1) / np.arange(1, d + 1)
    last = (ordered > excess).sum(axis=1) - 1
    return np.maximum(x - excess[np.arange(len(x)), last][:, None], 0)
