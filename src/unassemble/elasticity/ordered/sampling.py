"""A quick look whether rows form nodes at all, before every row is asked."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..directions.directions import find_directions
from ..rows.constants import ROUNDING
from ..rows.grouping import by_first_row, possible_nodes, same_pattern
from ..rows.likeness import reach
from .runs import stretches

_PLACES = (0.5, 0.2, 0.8)  # where to look, as parts of the rows
_MOST = 3000  # rows of a sample beyond which it is no quick look
_STARTS = 5
_ENOUGH = 0.3  # share of a sample's whole rows that annihilate constants, direction by direction


def promising(matrix: sp.csr_array, sizes: tuple[int, ...]) -> bool:
    """Whether directions can be found somewhere for which rows annihilate constants.

    In a sample, some row with its neighbours and theirs, the rows of the inner ones are whole.

    Parameters
    ----------
    matrix : (N, N) sparse
    sizes : tuple of int
        Block sizes to try.
    """
    order = matrix.shape[0]
    group = same_pattern(matrix, np.zeros(order, dtype=bool))
    return any(_directions_show(matrix, group, int(part * (order - 1)), sizes) for part in _PLACES)


def _directions_show(matrix: sp.csr_array, group: NDArray[np.int64], seed: int, sizes: tuple[int, ...]) -> bool:
    inner = _with_neighbours(matrix, np.array([seed]))
    rows = _with_neighbours(matrix, inner)
    if len(inner) < 4 or len(rows) > _MOST:
        return len(rows) > _MOST
    sample = sp.csr_array(matrix[rows][:, rows])
    whole = np.searchsorted(rows, inner)
    nobody = np.zeros(len(rows), dtype=bool)
    for d in sizes:
        for node in [*possible_nodes(by_first_row(group[rows]), d), stretches(reach(sample), d)[0]]:
            direction = find_directions(sample, node, nobody, d, starts=_STARTS)
            ones = np.zeros((len(rows), d))
            ones[np.arange(len(rows)), direction] = 1
            size = abs(sample[whole]) @ ones
            zero = np.abs(sample[whole] @ ones) <= ROUNDING * size.sum(axis=1, keepdims=True)
            # Sums of nothing are no evidence, and those of a row's own direction none of more than one.
            coupled = size > ROUNDING * size.sum(axis=1, keepdims=True)
            own = ones[whole].astype(bool)
            telling = (zero & coupled & ~own).any(axis=1) & (zero & own).any(axis=1)
            if telling.mean() > _ENOUGH:
                return True
    return False


def _with_neighbours(matrix: sp.csr_array, rows: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.union1d(rows, matrix[rows].indices)
