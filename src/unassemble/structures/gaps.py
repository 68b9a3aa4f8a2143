"""Nodes of structures some of whose unknowns supports took, in rows that stand node by node.

A matrix cut into nodes is written down with one index for each unknown that a node couples to, and one number for each
of its own unknowns beside it: the nodes are those with which it takes least.
"""

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodes.grouping import by_first_row, pattern_of
from ..tolerances import CANCELLED, SUMMED
from .layouts import LAYOUTS, Layout
from .straight import blocks_at, entries_at, misfits, told_by_blocks


def directions_with_gaps(matrix: sp.csr_array) -> Iterator[tuple[NDArray[np.int64], int]]:
    """Directions of rows (N,) where some nodes lack unknowns, -1 where not told, and how many there are."""
    if matrix.diagonal().all():
        for b in (6, 3):
            yield with_gaps(matrix, b)[1], b


def with_gaps(matrix: sp.csr_array, b: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Nodes and directions (N,) of rows that stand node by node; -1 for those of nodes that lack some of b unknowns.

    Rows of one node couple to nearly the same unknowns, so that hardly a number is a zero and the indices are shared;
    rows of two nodes share few. The shortest description is found by dynamic programming.
    """
    shown = [_shown_by_members(matrix, layout) for layout in LAYOUTS if layout.block_size == b]
    node = _cut(sp.csr_array(pattern_of(matrix)), b, np.any(shown, axis=0))
    within = np.arange(len(node)) - np.searchsorted(node, node)
    return node, np.where(np.bincount(node)[node] == b, within, -1)


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
    starts = [0]
    while starts[-1] < order:
        starts.append(starts[-1] + int(length[starts[-1]]))
    return np.repeat(np.arange(len(starts) - 1), np.diff(starts))


def continued(
    matrix: sp.csr_array, layout: Layout, node: NDArray[np.int64], given: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Nodes and directions (N,) with rows between whole nodes as further nodes where sums show that they are such.

    They are as many as other nodes have. Rows of a node that couple to different nodes, as directions do along the axes
    of flat parts, were cut apart. Each of its displacements has to complete the sums of some row; and all of its cuts
    to meet more than half of its neighbours, as those of two nodes do not.
    """
    b, moves = layout.block_size, len(layout.displacements)
    open_row = np.append(given < 0, False)
    first = np.flatnonzero(open_row & ~np.append(False, open_row[:-1]))
    last = np.flatnonzero(~open_row & np.append(False, open_row[:-1]))
    stretches = [(a, z) for a, z in zip(first, last, strict=True) if (z - a) % b == 0]
    starts = np.array([start for a, z in stretches for start in range(a, z, b)], dtype=np.int64)
    rows = starts[:, None] + np.arange(b)
    joined = node.copy()
    joined[rows] = node[rows[:, :1]]
    pattern = pattern_of(matrix)
    onto, whole = (sp.csr_array((np.ones(len(given), np.float32), (np.arange(len(given)), k))) for k in (node, joined))
    met, all_met = (np.diff(sp.csr_array(of.T @ pattern @ whole).indptr) for of in (onto, whole))
    rows = rows[(2 * met[node[rows]] > all_met[joined[rows]]).all(axis=1)]
    while len(rows):
        direction = given.copy()
        direction[rows] = np.arange(b)
        labels = (direction[:, None] == np.arange(moves)).astype(float)
        size = abs(matrix) @ labels
        good = (np.abs(matrix @ labels) <= CANCELLED * size).all(axis=1)
        shown = (good.astype(float) @ pattern)[rows[:, :moves]].all(axis=1)
        if shown.all():
            joined = node.copy()
            joined[rows] = node[rows[:, :1]]
            return by_first_row(joined), direction
        rows = rows[shown]
    return node, given


def _shown_by_members(matrix: sp.csr_array, layout: Layout) -> NDArray[np.bool_]:
    """(N,) rows with which a node begins whose unknowns stand in order: those of members show it."""
    order, b = matrix.shape[0], layout.block_size
    entry = matrix.tocoo()
    some = (entry.col >= entry.row + b) & (entry.col <= order - b) & (entry.data < 0)
    i, j = entry.row[some].astype(np.int64), entry.col[some].astype(np.int64)
    for k in range(1, len(layout.displacements)):
        some = entries_at(matrix, i + k, j + k) < 0
        i, j = i[some], j[some]
    blocks = blocks_at(matrix, i, j, b)
    good = misfits(blocks, -told_by_blocks(blocks, layout), layout) <= SUMMED
    begins = np.zeros(order, dtype=bool)
    begins[i[good]] = begins[j[good]] = True
    return begins
