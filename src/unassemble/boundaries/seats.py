"""Rows that boundary conditions have replaced, seated at vertices of a lattice: by the columns that were kept.

Two columns that are the same, as beside a corner of equal squares, can change places, and corners may be in no other
row. What is stored as zero between replaced rows seats these, too, since neighbours are stored only.
"""

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..tolerances import CERTIFIED
from ..topology.keys import contains
from .lattice import Lattice, sides_of


def seated(
    matrix: OperatorMatrix, own: NDArray[np.int64], lattice: Lattice
) -> tuple[NDArray[np.int64], NDArray[np.int8]] | None:
    """Numbers of the vertices of a lattice on rows `own`, (k,), and status of all rows; None where columns do not fit.

    Parameters
    ----------
    matrix : OperatorMatrix
    own : (k,) int
        Rows that the lattice has, others are of the identity.
    lattice : Lattice
        Of these rows.

    Returns
    -------
    row : (k + g,) int
        The row of each vertex; n, n + 1, ... for those that have none.
    status : (n,) int8
        As in :class:`..recovery.Recovery`.
    """
    n, k, beyond = matrix.n, len(own), lattice.beyond
    other = np.setdiff1d(np.arange(n), own)
    kept = matrix.csr()[own][:, other]
    tolerance = CERTIFIED * matrix.row_size[own]
    order, size, pattern = _sorted(beyond, tolerance)
    column, known_size, known = _sorted(sp.csr_array(kept), tolerance)
    status = np.ones(n, np.int8)
    status[own] = 0
    row = np.concatenate([own, np.full(beyond.shape[1], -1)])
    if len(column):
        if len(order) != len(column) or (pattern != known).any():
            return None
        near = CERTIFIED * np.maximum(np.abs(size), np.abs(known_size))
        if (np.abs(size - known_size) > near).any():
            return None
        row[k + order] = other[column]
        alike = (known[1:] == known[:-1]) & (np.abs(np.diff(known_size)) <= near[1:])
        status[other[column]] = np.where(np.append(alike, False) | np.append(False, alike), 2, 0)
        row, status = _by_neighbours(matrix, row, status, lattice.cells, k)
    gone = row < 0
    row[gone] = n + np.arange(int(gone.sum()))
    return row, status


def _by_neighbours(
    matrix: OperatorMatrix, row: NDArray[np.int64], status: NDArray[np.int8], cells: NDArray[np.int64], k: int
) -> tuple[NDArray[np.int64], NDArray[np.int8]]:
    """The same with those seated that have other neighbours than the rest among the rows that are seated for sure.

    As they were where neighbours that are stored are none in the lattice.
    """
    new, firm = row.copy(), status.copy()
    ends = sides_of(cells)
    ends = ends[(ends >= k).all(axis=1)]
    stored = matrix.edges[~np.isin(matrix.edges, row[:k]).any(axis=1)]
    label = np.random.default_rng(0).integers(1, 2**40, matrix.n)
    while True:
        sure = np.append(np.where(firm == 0, label, 0), 0)  # of no row
        by_row, by_vertex = np.zeros(matrix.n, np.int64), np.zeros(len(row), np.int64)
        for one, other in ((0, 1), (1, 0)):
            np.add.at(by_row, stored[:, one], sure[stored[:, other]])
            np.add.at(by_vertex, ends[:, one], sure[new[ends[:, other]]])
        rows = np.flatnonzero((firm > 0) & (by_row > 0))
        vertices = np.flatnonzero((by_vertex > 0) & (sure[new] == 0))
        seat = _pairs(by_row[rows], by_vertex[vertices])
        if not len(seat):
            break
        for one, vertex in zip(rows[seat[:, 0]].tolist(), vertices[seat[:, 1]].tolist(), strict=True):
            new[new == one] = new[vertex]  # they change places
            new[vertex], firm[one] = one, 0
    vertex = np.full(matrix.n, -1)
    vertex[new[new >= 0]] = np.flatnonzero(new >= 0)
    among = np.unique(np.sort(cells[:, list(combinations(range(cells.shape[1]), 2))].reshape(-1, 2)) @ [len(row), 1])
    pairs = np.sort(vertex[stored[(firm[stored] == 0).all(axis=1)]])
    return (new, firm) if contains(among, pairs @ [len(row), 1]).all() else (row, status)


def _pairs(one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.int64]:
    """(k, 2) places of the same value in both, where it is there once."""
    first, second = (np.unique(values, return_index=True, return_counts=True) for values in (one, other))
    _, a, b = np.intersect1d(first[0][first[2] == 1], second[0][second[2] == 1], return_indices=True)
    return np.column_stack([first[1][first[2] == 1][a], second[1][second[2] == 1][b]])


def _sorted(
    entries: sp.csr_array, tolerance: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.uint64]]:
    """Columns with entries, their sums, and labels of the rows these are in: in the order of labels and sums."""
    label = np.random.default_rng(0).integers(0, 2**63, entries.shape[0], dtype=np.uint64)
    found = entries.tocoo()
    some = np.abs(found.data) > tolerance[found.row]
    row, column, value = found.row[some], found.col[some], found.data[some]
    size = np.bincount(column, value, entries.shape[1]).astype(np.float64)
    pattern = np.zeros(entries.shape[1], dtype=np.uint64)
    np.add.at(pattern, column, label[row])
    order = np.lexsort((size, pattern))
    order = order[np.bincount(column, minlength=entries.shape[1])[order] > 0].astype(np.int64)
    return order, size[order], pattern[order]
