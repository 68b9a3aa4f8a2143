"""Whether unknowns that a node lacks were taken out, or only stand elsewhere: what was taken out leaves a trace."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .constants import ROUNDING, row_sizes, with_penalty
from .orders import Reading


def unaccounted(
    matrix: sp.csr_array, live: NDArray[np.bool_], node: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> NDArray[np.bool_]:
    """(n, d) directions that nodes lack although all rows coupled to them annihilate constants of that direction.

    A penalty on the diagonal is no trace.

    Parameters
    ----------
    matrix : (N, N) sparse
    live : (N,) bool
        Rows that count; those of the identity do not.
    node, direction : (N,) int64
    d : int
    """
    order, n = len(node), int(node.max()) + 1
    labels = np.zeros((order, d))
    labels[np.flatnonzero(live), direction[live]] = 1
    size = np.asarray(abs(matrix).sum(axis=1)).ravel()
    missing = (np.abs(matrix @ labels) > ROUNDING * size[:, None]) & live[:, None]
    missing[np.arange(order), direction] &= ~with_penalty(matrix, row_sizes(matrix))
    pattern = sp.csr_array((np.ones(matrix.nnz, np.int8), matrix.indices, matrix.indptr), shape=matrix.shape)
    onto = sp.csr_array((np.ones(order, np.int32), (node, np.arange(order))), shape=(n, order))
    missed = onto @ (pattern.astype(np.int32) @ missing.astype(np.int32))
    present = (onto @ labels) > 0
    return np.asarray(~present & (missed == 0) & present.any(axis=1)[:, None])


def shows_all(matrix: sp.csr_array, reading: Reading, d: int, live: NDArray[np.bool_] | None = None) -> bool:
    """Whether all nodes that lack a direction without a trace are among those that the reading leaves open.

    If not, equal patterns do not show every node, as where entries that vanished are not stored. Rows that are not
    `live`, (N,), do not count.
    """
    rows = np.ones(len(reading.node), dtype=bool) if live is None else live
    lost: NDArray[np.bool_] = np.asarray(unaccounted(matrix, rows, reading.node, reading.direction, d).any(axis=1))
    if reading.open_row is not None:
        lost[reading.node[reading.open_row]] = False
    return not lost.any()
