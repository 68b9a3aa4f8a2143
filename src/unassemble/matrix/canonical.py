"""One form for every sparse matrix: compressed rows, sorted, duplicates summed, explicit zeros kept."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import MatrixError
from ..words import count_of


def canonical(A: Any) -> sp.csr_array:
    """Bring a sparse matrix into compressed rows without losing its structure.

    Explicit zeros stay, those in the blocks of ``bsr`` included; only in the diagonal storage (``dia``) are
    they left out, where they cannot be told from padding. Duplicates are summed, in floating point. The
    argument is not changed; arrays may be shared with it.

    Parameters
    ----------
    A : scipy sparse matrix or array, two-dimensional, of numbers

    Returns
    -------
    csr_array
        Of dtype float64, complex128 or bool, columns increasing within each row.

    Raises
    ------
    MatrixError
        If the index arrays contradict the shape, or there are far more rows than entries.
    """
    problem = inconsistency(A)
    if problem:
        raise MatrixError(f"the sparse matrix is damaged: {problem}; build it anew from rows, columns and values")
    refuse_mostly_empty(A.shape[0], A.nnz)
    with np.errstate(over="ignore"):  # a long double beyond the range becomes infinite, and is found as such
        csr = sp.csr_array(A.astype(working_dtype(A.dtype), copy=False))
    csr.prune()
    if not csr.has_canonical_format:
        csr = csr.copy()
        csr.sum_duplicates()
    return csr


def refuse_mostly_empty(n: int, n_stored: int) -> None:
    """Raise before memory is spent on rows that cannot belong to a mesh.

    Raises
    ------
    MatrixError
        If n is beyond 100 (n_stored + 10).
    """
    if n > 100 * (n_stored + 10):  # a wrong header rather than a mesh
        raise MatrixError(
            f"at least {n - n_stored} of the {n} rows have no off-diagonal entry (only "
            f"{count_of(n_stored, 'entry is', 'entries are')} stored), so that this is no matrix of a mesh: check its "
            "size, or leave the empty rows out"
        )


def entry_rows(csr: sp.csr_array) -> NDArray:
    """(nnz,) row of each stored entry."""
    return np.repeat(np.arange(csr.shape[0], dtype=csr.indices.dtype), np.diff(csr.indptr))


def place(csr: sp.csr_array, k: int) -> tuple[int, int]:
    """Row and column of the k-th stored entry."""
    return int(np.searchsorted(csr.indptr, k, side="right")) - 1, int(csr.indices[k])


def inconsistency(A: Any) -> str | None:
    """What is wrong with the index arrays, in words; None where nothing is.

    Compiled code trusts these arrays: a wrong one reads or writes outside its memory.
    """
    if A.format == "coo":
        return _coordinates(A)
    if A.format in ("csr", "csc", "bsr"):
        return _compressed(A)
    return None


def _coordinates(A: Any) -> str | None:
    if not len(A.row) == len(A.col) == len(A.data):
        return f"it has {len(A.row)} row indices, {len(A.col)} column indices and {len(A.data)} values"
    return _range(A.row, A.shape[0], "row") or _range(A.col, A.shape[1], "column")


def _compressed(A: Any) -> str | None:
    rows, columns = A.shape
    if A.format == "bsr":
        rows, columns = rows // A.blocksize[0], columns // A.blocksize[1]
    major, minor, what = (columns, rows, "row") if A.format == "csc" else (rows, columns, "column")
    if A.indptr.ndim != 1 or A.indices.ndim != 1 or len(A.indptr) != major + 1:
        return f"its index pointer has {A.indptr.size} elements instead of {major + 1}"
    if A.indptr[0] != 0 or (np.diff(A.indptr) < 0).any():
        return "its index pointer does not increase from zero"
    n_stored = A.indptr[-1]
    if n_stored > min(len(A.indices), len(A.data)):
        return f"it announces {n_stored} entries and holds {min(len(A.indices), len(A.data))}"
    return _range(A.indices[:n_stored], minor, what)


def _range(index: NDArray, bound: int, what: str) -> str | None:
    if len(index) and (index.min() < 0 or index.max() >= bound):
        worst = index.min() if index.min() < 0 else index.max()
        return f"the {what} index {worst} is outside 0..{bound - 1}"
    return None


def working_dtype(dtype: np.dtype) -> type:
    """The type that entries of another one are converted to: bool, float64 or complex128."""
    if dtype.kind == "b":
        return np.bool_
    return np.complex128 if dtype.kind == "c" else np.float64
