"""How alike two rows are in what they couple to, over several steps of the graph.

Rows of one node start from the same place of the mesh. Over one step they may reach different rows, where entries that
vanished are not stored; over two or three the difference fades, while rows of neighbouring nodes stay apart.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import AT_ONCE
from ..tolerances import ALIKE, SIGMAS

_NUMBERS = 64  # of a sketch


def pattern_of(matrix: sp.csr_array) -> sp.csr_array:
    """(N, N) ones where entries are stored, in single precision."""
    return sp.csr_array((np.ones(matrix.nnz, np.float32), matrix.indices, matrix.indptr), shape=matrix.shape)


def reach(matrix: sp.csr_array) -> sp.csr_array:
    """(N, N) where rows lead to over three steps, each over the number of rows coupled to by halves; of norm one."""
    weight = sp.diags_array(1 / np.sqrt(np.maximum(np.diff(matrix.indptr), 1)).astype(np.float32))
    step = sp.csr_array(weight @ pattern_of(matrix) @ weight)
    reached = sp.csr_array(step @ step @ step)
    norm = np.sqrt(np.asarray(reached.power(2).sum(axis=1)).ravel())
    return sp.csr_array(sp.diags_array(1 / np.where(norm > 0, norm, 1).astype(np.float32)) @ reached)


def likest_pairs(
    reached: sp.csr_array, r: NDArray[np.int64], s: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Those of the pairs of rows (r, s) whose cosine is the largest of both rows, or equal to it; see :func:`reach`.

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
