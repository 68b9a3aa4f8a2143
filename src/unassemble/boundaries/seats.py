"""Rows that boundary conditions have replaced, seated at vertices of a lattice: by the columns that were kept.

Two columns that are the same, as beside a corner of equal squares, can change places, and corners may be in no other
row. What is stored as zero between replaced rows tells these, too, since neighbours are stored only.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..tolerances import CERTIFIED
from ..topology.keys import distinct, pair_keys
from .lattice import Lattice

Labels = NDArray[np.uint64]


def seated(
    matrix: OperatorMatrix, own: NDArray[np.int64], lattice: Lattice
) -> tuple[NDArray[np.int64], NDArray[np.int8]] | None:
    """Rows of the vertices of a lattice on rows `own`, (k,), and the status of all; None where columns do not fit.

    Returns `row` (k + g,) int64, n, n + 1, ... for vertices that have none, and `status` (n,) int8, as in
    :class:`..recovery.Recovery`.
    """
    n, k, size = matrix.n, len(own), matrix.row_size[own]
    beside = np.ones(n, dtype=bool)
    beside[own] = False
    other = np.flatnonzero(beside)
    by_vertex, vertex, labels = _columns(lattice.beyond, size)
    by_row, column, given = _columns(matrix.csr()[own][:, other], size)
    status = beside.astype(np.int8)
    seat = np.full(len(by_vertex), -1)
    if len(column):
        if not np.array_equal(labels, given):
            return None
        number = np.cumsum(beside) - 1
        stored = number[matrix.edges[beside[matrix.edges].all(axis=1)]]
        _seat(seat, by_vertex, by_row, lattice.cells - k, stored)
        status[other[seat[seat >= 0]]] = 0
        left, free = vertex[seat[vertex] < 0], column[~np.isin(column, seat)]
        seat[left], status[other[free]] = free, 2
    row = np.concatenate([own, np.append(other, -1)[seat]])
    gone = row < 0
    row[gone] = n + np.arange(int(gone.sum()))
    return row, status


def _columns(entries: sp.csr_array, size: NDArray[np.float64]) -> tuple[Labels, NDArray[np.int64], Labels]:
    """Labels of columns, (g,), 0 for empty ones; the others, (h,), in the order of labels and entries; and theirs.

    Labels are the same for columns that have the same entries, in rows of entries of `size`, (k,).
    """
    rng = np.random.default_rng(0)
    label, weight = rng.integers(2**63, size=len(size), dtype=np.uint64), rng.uniform(1, 2, len(size))
    found = entries.tocoo()
    some = np.abs(found.data) > CERTIFIED * size[found.row]
    row, column = found.row[some], found.col[some]
    labels = np.zeros(entries.shape[1], np.uint64)
    np.add.at(labels, column, label[row])
    value, near = (np.bincount(column, weight[row] * part, len(labels)) for part in (found.data[some], size[row]))
    order = np.lexsort((value, labels))
    order = order[labels[order] > 0]
    larger = np.diff(value[order], prepend=-np.inf) > CERTIFIED * near[order]
    labels[order] += np.cumsum(larger).astype(np.uint64)
    return labels, order, labels[order]


def _seat(
    seat: NDArray[np.int64], by_vertex: Labels, by_row: Labels, cells: NDArray[np.int64], stored: NDArray[np.int64]
) -> None:
    """Fill in the rows of vertices, (g,), as long as labels and seated neighbours tell one row and one vertex.

    `by_vertex` (g,) and `by_row` (r,) are labels, `stored` (e, 2) pairs of rows; corners of `cells` (m, k) that are
    none of these vertices are negative.
    """
    sides = np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)
    keys = distinct(pair_keys(len(seat), *sides[(sides >= 0).all(axis=1)].T))
    sides = np.column_stack(np.divmod(keys, len(seat)))
    label = np.random.default_rng(1).integers(2**63, size=len(by_row), dtype=np.uint64)
    at = np.full(len(by_row), -1)
    while True:
        known = np.flatnonzero(seat >= 0)
        at[seat[known]] = known
        vertex, row = _alone(by_vertex, sides, seat, label[seat]), _alone(by_row, stored, at, label)
        _, one, other = np.intersect1d(vertex[0], row[0], assume_unique=True, return_indices=True)
        if not len(one):
            return
        seat[vertex[1][one]] = row[1][other]


def _alone(
    labels: Labels, ends: NDArray[np.int64], seated: NDArray[np.int64], own: Labels
) -> tuple[Labels, NDArray[np.int64]]:
    """Sums of labels (k,) and those that seated neighbours have of their `own`, where no other is the same; and where.

    Of those not `seated`, (k,) negative.
    """
    sums, own = labels.copy(), np.where(seated >= 0, own, 0)
    for one, other in ends.T, ends.T[::-1]:
        np.add.at(sums, one, own[other])
    sums[seated >= 0] = 0
    value, place, count = np.unique(sums, return_index=True, return_counts=True)
    some = (count == 1) & (value > 0)
    return value[some], place[some]
