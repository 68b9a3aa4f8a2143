"""Rows grouped by what they couple to."""

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


def pattern_of(matrix: sp.csr_array) -> sp.csr_array:
    """(N, N) ones where entries are stored, in single precision."""
    return sp.csr_array((np.ones(matrix.nnz, np.float32), matrix.indices, matrix.indptr), shape=matrix.shape)


def same_pattern(matrix: sp.csr_array, identity: NDArray[np.bool_] | None = None) -> NDArray[np.int64]:
    """(N,) group of each row, by first row: those of the same columns; rows of the `identity` are groups alone."""
    key = np.random.default_rng(0).integers(1, 2**62, matrix.shape[1], dtype=np.uint64)
    pattern = sp.csr_array((np.ones(matrix.nnz, np.uint64), matrix.indices, matrix.indptr), shape=matrix.shape)
    code = pattern @ key  # sums wrap around, which does no harm
    if identity is not None:
        code[identity] = key[identity]
    return by_first_row(code)


def by_first_row(label: NDArray) -> NDArray[np.int64]:
    """Renumber labels by the first row that carries them."""
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[inverse]


def joined(first: NDArray[np.int64], second: NDArray[np.int64], n: int) -> NDArray[np.int64]:
    """(n,) labels of rows that pairs link, by way of others or not."""
    link = sp.csr_array((np.ones(len(first), np.int8), (first, second)), shape=(n, n))
    return np.asarray(sp.csgraph.connected_components(link, directed=False)[1], dtype=np.int64)


def by_direction(label: NDArray[np.int64], direction: NDArray[np.int64], d: int) -> NDArray[np.int64]:
    """(n, d) how many rows each label has of each direction."""
    count = np.zeros((int(label.max(initial=-1)) + 1, d), dtype=np.int64)
    np.add.at(count, (label, direction), 1)
    return count


def without_doubles(
    label: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(N,) labels as nodes, but that rows are alone which would make one with two rows of a direction; and these."""
    torn = np.asarray((by_direction(label, direction, d) > 1).any(axis=1))[label]
    return by_first_row(np.where(torn, len(label) + np.arange(len(label)), label)), torn


def coupled_in_common(matrix: sp.csr_array, node: NDArray[np.int64]) -> float:
    """How far the rows of one node couple to the same nodes: 1 if all do, about 1 / d if their nodes are made up."""
    n = node.max() + 1
    onto = sp.csr_array((np.ones(len(node), np.int32), (np.arange(len(node)), node)), shape=(len(node), n))
    pattern = sp.csr_array((np.ones(matrix.nnz, np.int32), matrix.indices, matrix.indptr), shape=matrix.shape)
    rows = pattern @ onto
    union = (onto.T.tocsr() @ rows).tocsr()
    return rows.nnz / float(np.diff(union.indptr) @ np.bincount(node))


def made_up(matrix: sp.csr_array, node: NDArray[np.int64], direction: NDArray[np.int64], d: int) -> NDArray[np.bool_]:
    """(n,) nodes two rows of which couple to no other node in common: they cannot be one node's."""
    n = int(node.max()) + 1
    entry = matrix.tocoo()
    row, other = node[entry.row], node[entry.col]
    reached = []
    for a in range(d):
        off = (direction[entry.row] == a) & (row != other)
        pairs = np.unique(row[off] * n + other[off])
        reached.append(sp.csr_array((np.ones(len(pairs), np.int8), (pairs // n, pairs % n)), shape=(n, n)))
    found = np.zeros(n, dtype=bool)
    for one, two in combinations(reached, 2):
        both = (np.diff(one.indptr) > 0) & (np.diff(two.indptr) > 0)
        found |= both & (np.diff(sp.csr_array(one.multiply(two)).indptr) == 0)
    return found
