"""Whether unknowns that a node lacks were taken out, or only stand elsewhere: what was taken out leaves a trace."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .constants import ROUNDING, row_sizes, with_penalty


def unaccounted(
    matrix: sp.csr_array,
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    d: int,
    live: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """(n, d) directions that nodes lack although all rows coupled to them annihilate constants of that direction.

    A penalty on the diagonal is no trace.

    Parameters
    ----------
    matrix : (N, N) sparse
    node, direction : (N,) int64
    d : int
    live : (N,) bool, optional
        Rows that count, all where not given; those of the identity do not.
    """
    order, n = len(node), int(node.max()) + 1
    live = np.ones(order, dtype=bool) if live is None else live
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
