"""Rows grouped by what they couple to."""

from __future__ import annotations

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


def split(group: NDArray[np.int64], d: int) -> NDArray[np.int64]:
    """Nodes of the same closed neighbourhood: take runs of consecutive rows, or else every k-th of a group."""
    order = np.argsort(group, kind="stable")
    start = np.searchsorted(group[order], np.arange(group.max() + 1))
    size = np.bincount(group)
    position = np.arange(len(group)) - np.repeat(start, size)
    jump = np.diff(order, prepend=-2) != 1
    jump[start] = True
    run = np.cumsum(jump) - 1
    place = np.arange(len(group)) - np.flatnonzero(jump)[run]
    in_runs = bool((np.bincount(run) % d == 0).mean() > 0.5)
    per_group = np.maximum(np.repeat(size // d, size), 1)
    big = np.repeat(size > d, size)
    part = (run * len(group) + place // d) if in_runs else position % per_group
    label = np.where(big, group[order] * (len(group) ** 2) + part + 1, group[order] * (len(group) ** 2))
    split = np.empty_like(group)
    split[order] = label
    return by_first_row(split)


def possible_nodes(group: NDArray[np.int64], d: int) -> list[NDArray[np.int64]]:
    """Labels of rows to start a search from: rows of the same pattern as nodes, if these are not too large; none."""
    whole = group if np.bincount(group).max() <= d else split(group, d)
    return [*([whole] if np.bincount(whole).max() <= d else []), np.arange(len(group))]


def coupled_in_common(matrix: sp.csr_array, node: NDArray, direction: NDArray) -> float:
    """How far the rows of one node couple to the same nodes: 1 if all do, about 1 / d if their nodes are made up."""
    n = node.max() + 1
    onto = sp.csr_array((np.ones(len(node), np.int32), (np.arange(len(node)), node)), shape=(len(node), n))
    pattern = sp.csr_array((np.ones(matrix.nnz, np.int32), matrix.indices, matrix.indptr), shape=matrix.shape)
    rows = pattern @ onto
    union = (onto.T.tocsr() @ rows).tocsr()
    return rows.nnz / float(np.diff(union.indptr) @ np.bincount(node))
