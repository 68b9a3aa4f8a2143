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

from .grouping import by_first_row, joined, same_pattern
from .likeness import likest_pairs, pattern_of, reach


def filled(matrix: sp.csr_array) -> sp.csr_array:
    """The matrix with zeros where rows that are likest each other have entries, and so on with these."""
    while True:
        pattern = pattern_of(matrix)
        near = sp.coo_array(sp.triu(pattern @ pattern, 1))
        pairs = likest_pairs(reach(matrix), near.row, near.col)
        more = _shared(matrix, joined(*pairs, matrix.shape[0]))
        if more.nnz == matrix.nnz:
            return matrix
        matrix = more


def filled_by_direction(matrix: sp.csr_array, direction: NDArray[np.int64], d: int) -> sp.csr_array:
    """The same where directions are known: between rows of one direction hardly an entry vanishes.

    Rows of one direction that couple to the same rows of it belong to nodes with the same neighbours. Those of
    different directions are compared, which leaves no doubt where entries vanish in the same way for whole directions.
    """
    n = matrix.shape[0]
    label = np.arange(n)
    rows = [np.flatnonzero(direction == a) for a in range(d)]
    for own in rows:
        label[own] = own[same_pattern(sp.csr_array(matrix[own][:, own]))]
    matrix = _shared(matrix, label)
    while True:
        pattern, reached = pattern_of(matrix), reach(matrix)
        first, second = [np.arange(n)], [n + label]
        for c, b in combinations([own for own in rows if len(own)], 2):
            cross = pattern[c][:, b]
            near = sp.coo_array(cross @ pattern[b][:, b] + pattern[c][:, c] @ cross)
            r, s = likest_pairs(reached, c[near.row], b[near.col])
            first.append(r)
            second.append(s)
        linked = joined(np.concatenate(first), np.concatenate(second), 2 * n)[:n]
        more = _shared(matrix, by_first_row(linked))
        if more.nnz == matrix.nnz:
            return matrix
        matrix = more


def _shared(matrix: sp.csr_array, label: NDArray[np.int64]) -> sp.csr_array:
    """The matrix with zeros so that rows of one label couple to the same rows, all of a label or none."""
    n = matrix.shape[0]
    onto = sp.csr_array((np.ones(n, np.float32), (np.arange(n), label)), shape=(n, int(label.max()) + 1))
    whole = sp.coo_array(onto @ (onto.T @ pattern_of(matrix) @ onto) @ onto.T)
    given = matrix.tocoo()
    ends = np.concatenate([given.row, whole.row]), np.concatenate([given.col, whole.col])
    return sp.csr_array((np.concatenate([given.data, np.zeros(whole.nnz)]), ends), shape=matrix.shape)
