"""Rows grouped by what they couple to."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


def same_pattern(matrix: sp.csr_array, identity: NDArray) -> NDArray[np.int64]:
    """(N,) group of each row, numbered by first row: rows whose stored entries stand in the same columns."""
    order = matrix.shape[0]
    key = np.random.default_rng(0).integers(1, 2**62, order, dtype=np.uint64)
    pattern = sp.csr_array((np.ones(matrix.nnz, np.uint64), matrix.indices, matrix.indptr), shape=matrix.shape)
    code = pattern @ key  # sums wrap around, which does no harm
    code[identity] = key[identity]
    return by_first_row(np.unique(code, return_inverse=True)[1])


def by_first_row(label: NDArray) -> NDArray[np.int64]:
    """Renumber labels by the first row that carries them."""
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[inverse]


def without_doubles(
    label: NDArray[np.int64], node: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(N,) labels as nodes, and which rows would make one with two rows of a direction: these keep their `node`."""
    key = label * d + direction
    torn = np.bincount(label, np.bincount(key)[key] > 1)[label] > 0
    return by_first_row(np.where(torn, len(label) + node, label)), torn


def possible_nodes(group: NDArray[np.int64], d: int) -> list[NDArray[np.int64]]:
    """Labels of rows to start a search from: rows of the same pattern as nodes, each row of larger groups by itself.

    Several nodes of the same neighbours make such a group; nothing about the pattern tells their rows apart.
    """
    single = np.arange(len(group))
    whole = by_first_row(np.where(np.bincount(group)[group] > d, len(group) + single, group))
    return [whole, single] if whole.max() < len(group) - 1 else [single]


def coupled_in_common(matrix: sp.csr_array, node: NDArray, direction: NDArray) -> float:
    """How far the rows of one node couple to the same nodes: 1 if all do, about 1 / d if their nodes are made up."""
    n = node.max() + 1
    onto = sp.csr_array((np.ones(len(node), np.int32), (np.arange(len(node)), node)), shape=(len(node), n))
    pattern = sp.csr_array((np.ones(matrix.nnz, np.int32), matrix.indices, matrix.indptr), shape=matrix.shape)
    rows = pattern @ onto
    union = (onto.T.tocsr() @ rows).tocsr()
    return rows.nnz / float(np.diff(union.indptr) @ np.bincount(node))


def made_up(matrix: sp.csr_array, node: NDArray, direction: NDArray, d: int) -> NDArray[np.bool_]:
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
