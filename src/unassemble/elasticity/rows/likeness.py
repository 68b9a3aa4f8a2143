"""How alike two rows are in what they couple to, over several steps of the graph.

Rows of one node start from the same place of the mesh. Over one step they may reach different rows, where entries that
vanished are not stored; over two or three the difference fades, while rows of neighbouring nodes stay apart.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

_STEPS = 2
_AT_ONCE = 1 << 22  # entries of the reach to multiply at a time
SAME = 1e-6  # single precision
_SAMPLE = 100
_FEW = 0.08  # share of pairs of rows whose likeness may be an exception
_DENSE = 6000  # rows up to which the reach of all fits in memory as a dense matrix, 144 MB
_FULL = 0.05  # share of its entries beyond which a dense one costs less time than a sparse one
_CHEAP = 30  # how much less time a product of dense matrices takes than as many products of single rows
_MOST = 60_000_000  # entries of a reach beyond which it is not taken a step further
_NUMBERS = 64  # of a sketch: 1 - cosine comes out to 18 % or so
_FACTOR = 3.0  # that 1 - cosine of a contender may be above the least, five times that error
_CLOSE = 0.06  # ... or whatever the least is: alignments weigh pairs that are nearly as alike against each other


def reach(matrix: sp.csr_array, steps: int = _STEPS) -> sp.csr_array:
    """(N, N) where the rows lead to over some steps of the graph, rows of norm one.

    Each step divides by the number of rows coupled to, half before and half after it.
    """
    pattern = sp.csr_array((np.ones(matrix.nnz, np.float32), matrix.indices, matrix.indptr), shape=matrix.shape)
    weight = sp.diags_array(1 / np.sqrt(np.maximum(np.diff(matrix.indptr), 1)).astype(np.float32))
    step = sp.csr_array(weight @ pattern @ weight)
    reached = step
    for _ in range(steps - 1):
        if reached.nnz * (step.nnz / max(step.shape[0], 1)) > _MOST * 8:
            break
        reached = sp.csr_array(step @ reached.toarray() if _full(reached) else step @ reached)  # which commute
    norm = np.sqrt(np.asarray(reached.power(2).sum(axis=1)).ravel())
    return sp.csr_array(sp.diags_array(1 / np.where(norm > 0, norm, 1).astype(np.float32)) @ reached)


def alike(reached: sp.csr_array, r: NDArray, s: NDArray) -> NDArray[np.float64]:
    """(k,) cosines between the reaches of rows r and s."""
    order = reached.shape[0]
    rows = reached.toarray() if _full(reached) else reached
    if _full(reached) and order**2 < _CHEAP * len(r):
        return np.asarray((rows @ rows.T)[r, s], dtype=np.float64)
    step = max(_AT_ONCE * order // max(reached.nnz, 1), 1)
    parts = [_products(rows[r[k : k + step]], rows[s[k : k + step]]) for k in range(0, len(r), step)]
    return np.concatenate([np.empty(0), *parts])


def _products(rows: sp.csr_array | NDArray, others: sp.csr_array | NDArray) -> NDArray[np.float64]:
    """(k,) inner products of rows of one matrix with those of another, added up in double precision."""
    if isinstance(rows, np.ndarray):
        return np.einsum("ij,ij->i", rows, others, dtype=np.float64)
    return np.asarray(rows.multiply(others).sum(axis=1), dtype=np.float64).ravel()


def _full(reached: sp.csr_array) -> bool:
    """Whether a dense matrix is the better one for it."""
    order = reached.shape[0]
    return order <= _DENSE and reached.nnz > _FULL * order**2


def contenders(reached: sp.csr_array, r: NDArray, s: NDArray) -> NDArray[np.int64]:
    """Places of the pairs of rows that may be each other's likest.

    Cosines of long sparse rows are costly, and most pairs are far from alike. A few random combinations of the columns
    keep angles, about, and leave a few pairs of each row (Johnson and Lindenstrauss, 1984).

    Parameters
    ----------
    reached : (N, N) sparse
        See :func:`reach`.
    r, s : (k,) int64
        Rows.
    """
    order = reached.shape[0]
    mixed = np.random.default_rng(0).standard_normal((order, _NUMBERS), dtype=np.float32)
    sketch = reached @ mixed
    sketch /= np.maximum(np.linalg.norm(sketch, axis=1, keepdims=True), np.finfo(np.float32).tiny)
    apart = np.empty(len(r), np.float32)
    for k in range(0, len(r), _AT_ONCE // _NUMBERS):
        some = slice(k, k + _AT_ONCE // _NUMBERS)
        apart[some] = 1 - np.einsum("ij,ij->i", sketch[r[some]], sketch[s[some]])
    least = np.full(order, np.inf, np.float32)
    for rows in (r, s):
        np.minimum.at(least, rows, apart)
    return np.flatnonzero(apart <= np.maximum(_CLOSE, _FACTOR * np.maximum(least[r], least[s])))


def compared(
    pattern: sp.csr_array, reached: sp.csr_array, rows_c: NDArray, rows_b: NDArray
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Pairs (r, s) of places in two lists of rows, at most two steps apart, and how alike they are.

    Pairs far less alike than others of both rows are left out.
    """
    cross = pattern[rows_c][:, rows_b]
    near = sp.coo_array(cross @ pattern[rows_b][:, rows_b] + pattern[rows_c][:, rows_c] @ cross)
    r, s = near.row.astype(np.int64), near.col.astype(np.int64)
    some = contenders(reached, rows_c[r], rows_b[s])
    r, s = r[some], s[some]
    return r, s, alike(reached, rows_c[r], rows_b[s])


def partners(
    pattern: sp.csr_array, reached: sp.csr_array, rows_c: NDArray, rows_b: NDArray
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Those of the pairs compared that are each other's likest, or equal to it."""
    r, s, value = compared(pattern, reached, rows_c, rows_b)
    best_r, best_s = np.zeros(len(rows_c)), np.zeros(len(rows_b))
    np.maximum.at(best_r, r, value)
    np.maximum.at(best_s, s, value)
    chosen = (value >= best_r[r] - SAME) & (value >= best_s[s] - SAME)
    return r[chosen], s[chosen], value[chosen]


def likest(
    pattern: sp.csr_array, reached: sp.csr_array, rows: NDArray, others: NDArray, direction: NDArray
) -> NDArray[np.bool_]:
    """(k,) whether of all rows of its direction at most two steps from row r, row s is the likest, or equal to it.

    Parameters
    ----------
    rows, others : (k,) int64
        Rows r and s.
    direction : (N,) int64
    """
    near = sp.coo_array(pattern[rows] @ pattern)
    fits = direction[near.col] == direction[others][near.row]
    which, other = near.row[fits].astype(np.int64), near.col[fits].astype(np.int64)
    best = np.zeros(len(rows))
    np.maximum.at(best, which, alike(reached, rows[which], other))
    return alike(reached, rows, others) >= best - SAME


def next_to_likest(matrix: sp.csr_array, reached: sp.csr_array) -> float:
    """Share of rows, of a hundred at most, that stand before or after the row which is likest them.

    Nearly all do where unknowns stand node by node, whatever was taken out, and none where they stand at random.
    """
    order = matrix.shape[0]
    pattern = sp.csr_array((np.ones(matrix.nnz, np.float32), matrix.indices, matrix.indptr), shape=matrix.shape)
    rows = np.unique(np.linspace(0, order - 1, min(order, _SAMPLE)).astype(np.int64))
    near = sp.coo_array(pattern[rows] @ pattern)
    apart = near.col != rows[near.row]
    which, other = near.row[apart].astype(np.int64), near.col[apart].astype(np.int64)
    value = alike(reached, rows[which], other)
    best = np.zeros(len(rows))
    np.maximum.at(best, which, value)
    beside = (np.abs(rows[which] - other) == 1) & (value >= best[which] - SAME)
    return float((np.bincount(which, beside, minlength=len(rows)) > 0).mean())


def doubtful(likeness: NDArray[np.float64]) -> float:
    """How alike rows have to be to be taken for one node, given how alike those are that mostly are."""
    return float(1 - SAME - 3 * (1 - np.quantile(likeness, _FEW))) if len(likeness) else 1.0
