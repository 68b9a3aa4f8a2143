"""Matrices written with few digits: their rows annihilate translations up to rounding only, and are set right.

What belongs to translations is known beforehand: away from supports the entries of a row and a direction add up to
zero. Where they do up to the rounding of each, the sum is taken off the entry between the row and its own node. Then a
row that a support touched stands out as clearly as in a matrix of full precision.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .orders import ORDERS, regular

_LAYOUTS = {3: (3, 2, 1), 2: (2,), 6: (3,)}  # unknowns of a node, and how many of these may be displacements
SPREADS = 20  # times the rounding of the entries: what an identity, or a sum of forces, may be off by
_FULL = 1e-10  # rounding below which nothing needs to be set right
_EXACT = 1e-14  # sums this small, beside the largest entry, are those of entries in full precision
_FEW = range(3, 10)  # numbers of decimal digits to look for
_LEAST = 0.05  # of the rows that have to annihilate all translations


def rounding_of(values: NDArray[np.float64]) -> float:
    """Relative rounding error that the entries of a matrix have at most; 0 for those of full precision.

    Single precision shows, and so does a small number of decimal digits.
    """
    values = values[values != 0]
    if not len(values):
        return 0.0
    some = values[:: max(1, len(values) // 2000)]
    with np.errstate(over="ignore"):  # too large for single precision
        single = some.astype(np.float32)
    if np.array_equal(some, single):
        short = bool((some == np.round(some)).all())  # small whole numbers are exact
        return 0.0 if short else float(np.finfo(np.float32).eps) / 2
    for digits in _FEW:
        if all(float(f"{x:.{digits - 1}e}") == x for x in some.tolist()):
            return 0.5 * 10.0 ** (1 - digits)
    return 0.0


def with_exact_sums(matrix: sp.csr_array) -> tuple[sp.csr_array, float]:
    """Take the rounding out of rows that annihilate translations, if unknowns stand in one of the usual orders.

    Parameters
    ----------
    matrix : (N, N) sparse

    Returns
    -------
    matrix : (N, N) sparse
        The given one where there is nothing to do.
    rounding : float
        Relative rounding of the entries; 0 where nothing was done.
    """
    rounding = rounding_of(matrix.data)
    if rounding <= _FULL:
        return matrix, 0.0
    size = abs(matrix)
    best, most = None, _LEAST
    for b, displacements in _LAYOUTS.items():
        if matrix.shape[0] % b:
            continue
        for kind in ORDERS:
            node, direction = regular(matrix.shape[0], b, kind)
            labels = (direction[:, None] == np.arange(b)).astype(float)
            sums, bounds = matrix @ labels, rounding * (size @ labels)
            zero = (np.abs(sums) <= bounds) & (bounds > 0)
            share = max(float(zero[:, :moves].all(axis=1).mean()) for moves in displacements)
            if share > most:
                best, most = (node, b, kind, np.where(zero, sums, 0.0)), share
    if best is None or np.abs(best[3]).max() <= _EXACT * size.max():  # dyadic numbers are exact, few digits or not
        return matrix, 0.0
    node, b, kind, excess = best
    row, direction = np.nonzero(excess)
    own = node[row] * b + direction if kind == "interleaved" else direction * (len(node) // b) + node[row]
    correction = sp.csr_array((excess[row, direction], (row, own)), shape=matrix.shape)
    return sp.csr_array(matrix - correction), rounding
