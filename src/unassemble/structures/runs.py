"""Nodes of rows that stand node by node where nodes lack unknowns and zeros are not stored: the shortest description.

A matrix cut into nodes is written down with one index for each unknown that a node couples to, and one number for each
of its own unknowns beside it. Rows of one node couple to nearly the same unknowns, so that hardly a number is a zero
and the indices are shared; rows of two nodes share few. What takes least to write down is found by dynamic programming.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodes.likeness import pattern_of


def shortest_runs(matrix: sp.csr_array, most: int, begins: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(N,) nodes of neighbouring rows, each of at most so many; a node of so many `begins` with some rows, (N,).

    What the first cut takes for one node is one unknown to couple to for the next, as long as fewer nodes come of it:
    rows of nodes some of whose directions are not coupled, as in flat shells along an axis, meet the same nodes. Every
    row has an entry on the diagonal.
    """
    order = matrix.shape[0]
    pattern = sp.csr_array(pattern_of(matrix))
    node = np.arange(order)
    while True:
        onto = sp.csr_array((np.ones(order, np.float32), (np.arange(order), node)))
        cut = _cut(sp.csr_array(pattern @ onto), most, begins)
        if cut[-1] >= node[-1]:
            return node
        node = cut


def _cut(pattern: sp.csr_array, most: int, begins: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(N,) runs of rows for which (columns in any of them) (rows + 1) is least in all; those known cost nothing."""
    order = pattern.shape[0]
    cost = np.full((order, most), np.inf)
    union = pattern
    for k in range(min(most, order)):
        if k:
            union = sp.csr_array(union[:-1] + pattern[k:])
        cost[: order - k, k] = (k + 2.0) * np.diff(union.indptr)
    cost[np.flatnonzero(begins), most - 1] = 0
    least, length = np.zeros(order + most), np.ones(order, dtype=np.int64)
    for row in range(order - 1, -1, -1):
        ways = cost[row] + least[row + 1 : row + 1 + most]
        length[row] = ways.argmin() + 1
        least[row] = ways[length[row] - 1]
    first = np.zeros(order, dtype=np.int64)
    row = 0
    while row < order:
        first[row] = 1
        row += int(length[row])
    return np.cumsum(first) - 1
