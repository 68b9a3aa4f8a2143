"""Which rows of an elastic body's matrix lack nothing, and what else than elements is in them."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from ..tolerances import CANCELLED, PENALTY


def row_sizes(matrix: sp.csr_array, node_of_row: NDArray) -> NDArray[np.float64]:
    """(N,) largest entry of each row with another node."""
    entry = matrix.tocoo()
    apart = node_of_row[entry.row] != node_of_row[entry.col]
    size = np.zeros(matrix.shape[0])
    np.maximum.at(size, entry.row[apart], np.abs(entry.data[apart]))
    return size


def penalised(matrix: sp.csr_array, node_of_row: NDArray) -> NDArray[np.bool_]:
    """(N,) rows that do not add up to zero over all unknowns, as with a support on the diagonal."""
    total = np.asarray(matrix.sum(axis=1)).ravel()
    entry = matrix.tocoo()
    apart = node_of_row[entry.row] != node_of_row[entry.col]
    size = np.bincount(entry.row[apart], np.abs(entry.data[apart]), matrix.shape[0])
    return np.asarray(np.abs(total) > CANCELLED * size)


def surrounded(
    matrix: sp.csr_array, node_of_row: NDArray, direction_of_row: NDArray, known: NDArray[np.bool_], d: int
) -> NDArray[np.bool_]:
    """(N,) rows of nodes that have all d rows and a position, and so have all that these couple to.

    Their entries add up to zero in each direction. Those of rows with a support on the diagonal do not add up to it in
    their own; where the diagonal is as large as a penalty that is why, and no neighbour need be gone. Yet one may be:
    in regular meshes what is lost adds up to zero in the other directions. It does not in a row of the node without a
    penalty, nor at the ends of a line or patch of nodes that have penalties in all directions.
    """
    order, n = len(node_of_row), len(known)
    named = (direction_of_row >= 0) & (row_sizes(matrix, node_of_row) > 0)
    whole = known & (np.bincount(node_of_row[named], minlength=n) == d)
    entry = matrix.tocoo()
    keep = (direction_of_row[entry.col] >= 0) & (entry.row != entry.col)
    sums = np.zeros((order, d))
    np.add.at(sums, (entry.row[keep], direction_of_row[entry.col[keep]]), entry.data[keep])
    apart = node_of_row[entry.row] != node_of_row[entry.col]
    size = np.bincount(entry.row[apart], np.abs(entry.data[apart]), order)
    sums[np.arange(order), np.maximum(direction_of_row, 0)] += matrix.diagonal()
    zero = np.abs(sums) <= CANCELLED * size[:, None]
    penalty = np.abs(matrix.diagonal()) > PENALTY * size
    zero[np.arange(order), np.maximum(direction_of_row, 0)] |= penalty
    good = zero.all(axis=1) & (size > 0) & (direction_of_row >= 0)
    good &= np.bincount(entry.row, ~whole[node_of_row[entry.col]] & (entry.data != 0), order) == 0
    all_good = np.bincount(node_of_row, good, minlength=n) == d
    alone = all_good & (np.bincount(node_of_row, good & ~penalty, minlength=n) == 0)
    if alone.any():
        live = entry.data != 0
        near = (np.ones(live.sum()), (node_of_row[entry.row[live]], node_of_row[entry.col[live]]))
        graph = sp.csr_array(near, shape=(n, n))
        between = sp.diags_array(alone.astype(float))
        _, patch = connected_components(sp.csr_array(between @ graph @ between), directed=False)
        beside = np.bincount(patch, graph @ (~all_good).astype(float) > 0) > 0
        all_good &= ~(alone & beside[patch])
    return np.asarray(all_good[node_of_row] & good)


def without_springs(
    matrix: sp.csr_array, node_of_row: NDArray, direction_of_row: NDArray, compared: NDArray[np.bool_]
) -> sp.csr_array:
    """The matrix without blocks of two nodes that no third couples to, and without what they add to the diagonal.

    A spring adds a block to the rows of its two nodes and takes it off between them. Two nodes of a cell are coupled
    to its other nodes, all of which are there around nodes of which one is `compared`, by its rows (N,).
    """
    entry, n = matrix.tocoo(), int(node_of_row.max(initial=-1)) + 1
    i, j = node_of_row[entry.row], node_of_row[entry.col]
    live = (entry.data != 0) & (i != j)
    near = sp.csr_array((np.ones(live.sum()), (i[live], j[live])), shape=(n, n))
    near.data[:] = 1
    third = sp.csr_array((near @ near).multiply(near)) > 0
    pair = np.unique(i[live] * n + j[live])
    a, b = third.nonzero()
    surrounded = np.zeros(n, dtype=bool)
    surrounded[node_of_row[compared]] = True
    alone = np.setdiff1d(pair, a.astype(np.int64) * n + b)
    alone = alone[surrounded[alone // n] | surrounded[alone % n]]
    springs = live & np.isin(i * n + j, alone) & (direction_of_row[entry.row] >= 0)
    if not springs.any() or n <= 2:
        return matrix
    place = np.full((n, int(direction_of_row.max()) + 1), -1)
    place[node_of_row, np.maximum(direction_of_row, 0)] = np.arange(len(node_of_row))
    row, column, value = entry.row[springs], entry.col[springs], entry.data[springs]
    own = place[node_of_row[row], direction_of_row[column]]
    there = own >= 0
    moved = sp.coo_array(
        (
            np.concatenate([value[there], -value]),
            (np.concatenate([row[there], row]), np.concatenate([own[there], column])),
        ),
        shape=matrix.shape,
    )
    return sp.csr_array(matrix + moved.tocsr())
