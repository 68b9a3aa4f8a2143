"""Nodes from likeness alone, where neither patterns nor directions are of help."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..rows.grouping import by_first_row
from ..rows.likeness import SAME, alike, reach

_STEPS = 4  # likeness of rows of all directions has more to tell apart


def bunched(matrix: sp.csr_array, d: int) -> NDArray[np.int64]:
    """(N,) labels of sets of at most d rows that are likest each other, whatever their directions.

    Rows of one node start from one place and reach the same rows over some steps of the graph. Those of the nodes next
    to it do not, though they be of the same direction. So nodes of k rows are sets of rows that prefer each other to
    all others: first those of d rows, then, of the rows that are left, those of fewer.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric.
    d : int
    """
    order = matrix.shape[0]
    pattern = sp.csr_array((np.ones(matrix.nnz, np.float32), matrix.indices, matrix.indptr), shape=matrix.shape)
    near = sp.coo_array(sp.triu(pattern @ pattern, 1))
    value = alike(reach(matrix, _STEPS), near.row, near.col)
    likeness = sp.coo_array((value, (near.row, near.col)), shape=matrix.shape).tocsr()
    likeness = sp.csr_array(likeness + likeness.T)
    label, left = np.arange(order), np.arange(order)
    for k in range(d, 1, -1):
        found = _cliques(likeness[left][:, left], k)
        label[left[found]] = left[found[:, :1]]
        left = np.setdiff1d(left, left[found])
    return by_first_row(label)


def _cliques(likeness: sp.csr_array, k: int) -> NDArray[np.int64]:
    """(m, k) rows each of which has the others of its set, and no more, among the k - 1 likest it."""
    order = likeness.shape[0]
    pairs = likeness.tocoo()
    by_likeness = np.lexsort((-pairs.data, pairs.row))
    row, column, value = pairs.row[by_likeness], pairs.col[by_likeness], pairs.data[by_likeness]
    start = likeness.indptr[:-1]
    enough = np.flatnonzero(np.diff(likeness.indptr) >= k - 1)
    least = np.full(order, np.inf)
    least[enough] = value[start[enough] + k - 2] - SAME
    chosen = value >= least[row]
    some = sp.csr_array((np.ones(chosen.sum(), np.int8), (row[chosen], column[chosen])), shape=(order, order))
    both = sp.csr_array(some.multiply(some.T))
    label = sp.csgraph.connected_components(both, directed=False)[1]
    closed = (np.bincount(label)[label] == k) & (np.bincount(label, np.diff(both.indptr))[label] == k * (k - 1))
    rows = np.flatnonzero(closed)
    return rows[np.argsort(label[rows], kind="stable")].reshape(-1, k)
