"""Matrices written with few digits: their rows annihilate translations up to rounding only, and are set right.

What belongs to translations is known beforehand: away from supports the entries of a row and a direction add up to
zero. Where they do up to the rounding of each, the sum is taken off the largest of them. Then a
row that a support touched stands out as clearly as in a matrix of full precision.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..rows.constants import uncoupled_rows
from ..rows.orders import ORDERS, regular
from .components import directions_by_component
from .runs import directions_node_by_node

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
    size = np.abs(values)
    values = values[size > _EXACT * size.max(initial=0)]  # less is left where entries cancel, in no few digits
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
    total = np.asarray(size.sum(axis=1)).ravel()
    best, most = None, _LEAST
    for direction, b in _readings(matrix, rounding):
        labels = (direction[:, None] == np.arange(b)).astype(float)
        sums, sizes = matrix @ labels, size @ labels
        zero = (np.abs(sums) <= rounding * sizes + _EXACT * total[:, None]) & (sizes > _EXACT * total[:, None])
        share = max(float(zero[:, :moves].all(axis=1).mean()) for moves in _LAYOUTS[b])
        if share > most:
            best, most = (direction, np.where(zero, sums, 0.0)), share
    if best is None or np.abs(best[1]).max() <= _EXACT * size.max():  # dyadic numbers are exact, few digits or not
        return matrix, 0.0
    return _without(matrix, *best), rounding


def _readings(matrix: sp.csr_array, rounding: float) -> Iterator[tuple[NDArray[np.int64], int]]:
    """Directions of rows in one of the usual orders, and how many; with gaps where supports took some rows."""
    order = matrix.shape[0]
    for b in _LAYOUTS:
        for kind in ORDERS:
            if order % b == 0:
                yield regular(order, b, kind)[1], b
    live = np.flatnonzero(~uncoupled_rows(matrix))
    inner = sp.csr_array(matrix[live][:, live])
    inner.sort_indices()
    for d in (3, 2):
        for found in (directions_by_component(inner, d, rounding), directions_node_by_node(inner, d, rounding)):
            if found is not None:
                direction = np.full(order, -1)
                direction[live] = found
                yield direction, d


def _without(matrix: sp.csr_array, direction: NDArray[np.int64], excess: NDArray[np.float64]) -> sp.csr_array:
    """The matrix after sums (N, b) of rows and directions were taken off the largest entry of each."""
    entry = matrix.tocoo(copy=True)
    b = excess.shape[1]
    key = entry.row * (b + 1) + direction[entry.col]
    order = np.lexsort((np.abs(entry.data), key))
    last = order[np.append(np.diff(key[order]) > 0, True)]
    last = last[direction[entry.col[last]] >= 0]
    entry.data[last] -= excess[entry.row[last], direction[entry.col[last]]]
    return sp.csr_array(entry)
