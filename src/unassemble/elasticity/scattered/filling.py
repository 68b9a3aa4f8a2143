"""Entries that vanish put back where they were not stored, so that the rows of one node show by their pattern again.

Rows of one node start from the same place of the mesh, and so do those of nodes in the same cells. In what they reach
over some steps of the graph they are likest each other, though entries vanish by symmetry in some of them and not in
others. Rows that are likest each other are given what any of them couples to, and so are the columns; with these
entries more rows show where they belong.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..rows.grouping import same_pattern
from ..rows.likeness import SAME, alike, contenders, partners, reach

_STEPS = 4  # of the graph; rows of all directions have more to tell apart
_STEPS_BY_DIRECTION = 3
_ROUNDS = 8


def likest(matrix: sp.csr_array) -> NDArray[np.int64]:
    """(N,) labels of rows that are likest each other, whatever their directions.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric.
    """
    pattern = _pattern(matrix)
    near = sp.coo_array(sp.triu(pattern @ pattern, 1))
    reached = reach(matrix, _STEPS)
    some = contenders(reached, near.row, near.col)
    r, s = near.row[some], near.col[some]
    value = alike(reached, r, s)
    best = np.zeros(matrix.shape[0])
    for ends in (r, s):
        np.maximum.at(best, ends, value)
    chosen = (value >= best[r] - SAME) & (value >= best[s] - SAME)
    return _linked(r[chosen], s[chosen], np.arange(matrix.shape[0]))


def filled(matrix: sp.csr_array, label: NDArray[np.int64]) -> sp.csr_array:
    """The matrix with zeros where rows that are likest each other have entries, and so on with these.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric.
    label : (N,) int64
        See :func:`likest`.
    """
    for _ in range(_ROUNDS):
        more = _shared(matrix, label)
        if more.nnz == matrix.nnz:
            break
        matrix, label = more, likest(more)
    return _shared(matrix, _with_the_same_others(matrix))


def _with_the_same_others(matrix: sp.csr_array) -> NDArray[np.int64]:
    """(N,) labels of rows that couple to the same unknowns but for their own.

    Of two nodes whose directions change places when they do, x of one and y of the other are as like as can be, and
    nothing may be stored between these two and the other two.
    """
    n = matrix.shape[0]
    group = same_pattern(matrix, np.zeros(n, dtype=bool))
    onto = sp.csr_array((np.ones(n, np.float32), (np.arange(n), group)), shape=(n, int(group.max()) + 1))
    around = sp.csr_array(onto.T @ _pattern(matrix) @ onto)
    around.setdiag(0)
    around.eliminate_zeros()
    return same_pattern(around, np.diff(around.indptr) == 0)[group]


def filled_by_direction(
    matrix: sp.csr_array, direction: NDArray[np.int64], live: NDArray[np.bool_], d: int
) -> sp.csr_array:
    """The same where directions are known: between rows of one direction hardly an entry vanishes.

    Rows of one direction that couple to the same rows of it belong to nodes with the same neighbours. Those of
    different directions are compared, which leaves no doubt where entries vanish in the same way for whole directions.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric.
    direction : (N,) int64
    live : (N,) bool
        Rows that count; those of the identity do not.
    d : int
    """
    label = np.arange(matrix.shape[0])
    rows = [np.flatnonzero((direction == a) & live) for a in range(d)]
    for own in rows:
        label[own] = own[same_pattern(sp.csr_array(matrix[own][:, own]), np.zeros(len(own), dtype=bool))]
    matrix = _shared(matrix, label)
    for _ in range(_ROUNDS):
        pattern, reached = _pattern(matrix), reach(matrix, _STEPS_BY_DIRECTION)
        pairs = [np.empty((2, 0), np.int64)]
        for c, b in combinations(range(d), 2):
            if len(rows[c]) and len(rows[b]):
                r, s, _ = partners(pattern, reached, rows[c], rows[b])
                pairs.append(np.stack([rows[c][r], rows[b][s]]))
        first, second = np.hstack(pairs)
        more = _shared(matrix, _linked(first, second, label))
        if more.nnz == matrix.nnz:
            break
        matrix = more
    return matrix


def _pattern(matrix: sp.csr_array) -> sp.csr_array:
    return sp.csr_array((np.ones(matrix.nnz, np.float32), matrix.indices, matrix.indptr), shape=matrix.shape)


def _linked(first: NDArray, second: NDArray, label: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N,) labels of rows that are linked, or of the same label below N."""
    n = len(label)
    ends = np.concatenate([first, np.arange(n)]), np.concatenate([second, n + label])
    link = sp.csr_array((np.ones(len(ends[0]), np.int8), ends), shape=(2 * n, 2 * n))
    return np.asarray(sp.csgraph.connected_components(link, directed=False)[1][:n], dtype=np.int64)


def _shared(matrix: sp.csr_array, label: NDArray[np.int64]) -> sp.csr_array:
    """The matrix with zeros so that rows of one label couple to the same rows, all of a label or none."""
    n = matrix.shape[0]
    onto = sp.csr_array((np.ones(n, np.float32), (np.arange(n), label)), shape=(n, int(label.max()) + 1))
    whole = sp.coo_array(onto @ (onto.T @ _pattern(matrix) @ onto) @ onto.T)
    given = matrix.tocoo()
    ends = np.concatenate([given.row, whole.row]), np.concatenate([given.col, whole.col])
    return sp.csr_array((np.concatenate([given.data, np.zeros(whole.nnz)]), ends), shape=matrix.shape)
