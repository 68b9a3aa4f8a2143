"""Node by node, but with unknowns missing here and there: pins and rollers."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

_WHOLE = 0.5  # of the rows that have to belong to whole nodes


def with_gaps(matrix: sp.csr_array, b: int) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Nodes of rows that stand node by node, where some nodes lack unknowns; None if the pattern shows no nodes.

    The rows of a node couple to the same columns, zeros being stored, as assembly leaves them.

    Parameters
    ----------
    matrix : (N, N) sparse
    b : int
        Unknowns of a whole node.

    Returns
    -------
    node : (N,) int64
    direction : (N,) int64
        -1 for rows of nodes that lack unknowns: which ones, the pattern does not tell.
    """
    order = matrix.shape[0]
    pattern = sp.csr_array((np.ones(matrix.nnz), matrix.indices, matrix.indptr), shape=matrix.shape)
    mark = pattern @ np.random.default_rng(0).random(order)
    first = np.flatnonzero(np.append(True, np.abs(np.diff(mark)) > 1e-12 * mark[1:]))
    length = np.diff(np.append(first, order))
    if (length % b)[length > b].any() or length[length % b == 0].sum() < _WHOLE * order:
        return None
    # Neighbours in the numbering may couple to the same columns all by chance: such a run is several nodes.
    within = np.arange(order) - np.repeat(first, length)
    whole = np.repeat(length % b == 0, length)
    node = np.cumsum((within == 0) | (whole & (within % b == 0))) - 1
    return node, np.where(whole, within % b, -1)
