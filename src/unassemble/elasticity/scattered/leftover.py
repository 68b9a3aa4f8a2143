"""Rows left by themselves where nothing was taken out: each belongs to another that is left."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..rows.grouping import by_first_row
from ..rows.likeness import partners, reach
from ..rows.traces import unaccounted

_ROUNDS = 10


def leftover_joined(
    matrix: sp.csr_array, live: NDArray[np.bool_], node: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> NDArray[np.int64]:
    """(N,) nodes after those that lack directions without a trace were joined, the likest ones.

    The rows that they lack are among those that other nodes of the same sort have: few, so that the likest both ways
    can be believed where, among all rows, a node that lost a direction might be liker.

    Parameters
    ----------
    matrix : (N, N) sparse
    live : (N,) bool
        Rows that count.
    node, direction : (N,) int64
    d : int
    """
    pattern = sp.csr_array((np.ones(matrix.nnz, np.float32), matrix.indices, matrix.indptr), shape=matrix.shape)
    reached = reach(matrix)
    for _ in range(_ROUNDS):
        lost = unaccounted(matrix, live, node, direction, d)[node]
        first, second = [], []
        for c, b in combinations(range(d), 2):
            rows_c = np.flatnonzero((direction == c) & lost[:, b])
            rows_b = np.flatnonzero((direction == b) & lost[:, c])
            if len(rows_c) and len(rows_b):
                r, s, _ = partners(pattern, reached, rows_c, rows_b)
                alone = (np.bincount(r)[r] == 1) & (np.bincount(s)[s] == 1)  # where several are alike, nothing decides
                first.append(rows_c[r[alone]])
                second.append(rows_b[s[alone]])
        again = _linked(node, direction, first, second, d)
        if again.max() == node.max():
            break
        node = again
    return node


def _linked(
    node: NDArray[np.int64], direction: NDArray[np.int64], first: list[NDArray], second: list[NDArray], d: int
) -> NDArray[np.int64]:
    """Nodes with those of linked rows joined, unless two rows of one direction would meet."""
    n = int(node.max()) + 1
    ends = [np.concatenate([np.empty(0, np.int64), *rows]) for rows in (first, second)]
    link = sp.csr_array((np.ones(len(ends[0]), np.int8), (node[ends[0]], node[ends[1]])), shape=(n, n))
    label = sp.csgraph.connected_components(link, directed=False)[1].astype(np.int64)[node]
    twice = np.bincount(label * d + direction)[label * d + direction] > 1
    torn = np.bincount(label, twice)[label] > 0
    return by_first_row(np.where(torn, n + node, label))
