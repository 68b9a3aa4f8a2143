"""Entries that vanish put back where they were not stored, so that the rows of one node show by their pattern again.

Rows of one node start from the same place of the mesh, and so do those of nodes in the same cells. In what they reach
over some steps of the graph they are likest each other, though entries vanish by symmetry in some of them and not in
others: over one step they may reach different rows, over two or three the difference fades, while rows of neighbouring
nodes stay apart. Rows that are likest each other are given what any of them couples to, and so are the columns; with
these entries more rows show where they belong.
"""

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import AT_ONCE
from ..tolerances import ALIKE, SIGMAS
from .grouping import by_first_row, joined, pattern_of, same_pattern

_NUMBERS = 64  # of a sketch


def filled(matrix: sp.csr_array) -> sp.csr_array:
    """The matrix with zeros where rows that are likest each other have entries, and so on with these."""
    while True:
        pattern = pattern_of(matrix)
        near = sp.coo_array(sp.triu(pattern @ pattern, 1))
        pairs = _likest_pairs(_reach(matrix), near.row, near.col)
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
        pattern, reached = pattern_of(matrix), _reach(matrix)
        pairs = [(np.arange(n), n + label)]
        for c, b in combinations([own for own in rows if len(own)], 2):
            cross = pattern[c][:, b]
            near = sp.coo_array(cross @ pattern[b][:, b] + pattern[c][:, c] @ cross)
            pairs.append(_likest_pairs(reached, c[near.row], b[near.col]))
        first, second = map(np.concatenate, zip(*pairs, strict=True))
        linked = joined(first, second, 2 * n)[:n]
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


def _reach(matrix: sp.csr_array) -> sp.csr_array:
    """(N, N) where rows lead to over three steps, each over the number of rows coupled to by halves; of norm one."""
    weight = sp.diags_array(1 / np.sqrt(np.maximum(np.diff(matrix.indptr), 1)).astype(np.float32))
    step = sp.csr_array(weight @ pattern_of(matrix) @ weight)
    reached = sp.csr_array(step @ step @ step)
    norm = np.sqrt(np.asarray(reached.power(2).sum(axis=1)).ravel())
    return sp.csr_array(sp.diags_array(1 / np.where(norm > 0, norm, 1).astype(np.float32)) @ reached)


def _likest_pairs(
    reached: sp.csr_array, r: NDArray[np.int64], s: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Those of the pairs of rows (r, s) whose cosine is the largest of both rows, or equal to it; see :func:`_reach`.

    Cosines of long sparse rows are costly, and most pairs are far from alike. A few random combinations of the columns
    keep angles, about, and leave a few pairs of each row (Johnson and Lindenstrauss, 1984).
    """
    order = reached.shape[0]
    sketch = reached @ np.random.default_rng(0).standard_normal((order, _NUMBERS), dtype=np.float32)
    sketch /= np.maximum(np.linalg.norm(sketch, axis=1, keepdims=True), np.finfo(np.float32).tiny)
    apart = np.empty(len(r), np.float32)
    for k in range(0, len(r), AT_ONCE // _NUMBERS):
        some = slice(k, k + AT_ONCE // _NUMBERS)
        apart[some] = 1 - np.einsum("ij,ij->i", sketch[r[some]], sketch[s[some]])
    least = np.full(order, np.inf, np.float32)
    for rows in (r, s):
        np.minimum.at(least, rows, apart)
    close = np.maximum(ALIKE, np.maximum(least[r], least[s]))
    error = np.sqrt(2 / _NUMBERS)  # of 1 - cosine, relative
    contenders = np.flatnonzero(apart <= (1 + SIGMAS * error) * close)
    r, s = r[contenders], s[contenders]
    step = max(AT_ONCE * order // max(reached.nnz, 1), 1)
    parts = [reached[r[k : k + step]].multiply(reached[s[k : k + step]]) for k in range(0, len(r), step)]
    sums = [np.asarray(part.sum(axis=1), dtype=np.float64).ravel() for part in parts]
    value, best = np.concatenate([np.empty(0), *sums]), np.zeros(order)
    for rows in (r, s):
        np.maximum.at(best, rows, value)
    chosen = (value >= best[r] - ALIKE) & (value >= best[s] - ALIKE)
    return r[chosen], s[chosen]
