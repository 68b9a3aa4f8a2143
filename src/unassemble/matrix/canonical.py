"""One form for every sparse matrix: compressed rows, sorted, duplicates summed, explicit zeros kept."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import MatrixError
from ..words import count_of


def canonical(A: Any) -> sp.csr_array:
    """Bring a scipy sparse matrix of numbers into compressed rows without losing its structure.

    Explicit zeros stay, those in the blocks of ``bsr`` included; only in the diagonal storage (``dia``) are
    they left out, where they cannot be told from padding. Duplicates are summed, in floating point. The
    argument is not changed; arrays may be shared with it. The result is of dtype float64, complex128 or bool, with
    columns increasing within each row.

    Raises MatrixError if the index arrays contradict the shape, or there are far more rows than entries.
    """
    if problem := inconsistency(A):
        raise MatrixError(f"the sparse matrix is damaged: {problem}; build it anew from rows, columns and values")
    n, n_stored = A.shape[0], A.nnz
    if n > 100 * (n_stored + 10):  # a wrong header rather than a mesh, for which no memory is spent
        raise MatrixError(
            f"at least {n - n_stored} of the {n} rows have no off-diagonal entry (only "
            f"{count_of(n_stored, 'entry is', 'entries are')} stored), so that this is no matrix of a mesh: check its "
            "size, or leave the empty rows out"
        )
    with np.errstate(over="ignore"):  # a long double beyond the range becomes infinite, and is found as such
        csr = sp.csr_array(A.astype(working_dtype(A.dtype), copy=False))
    csr.prune()
    if not csr.has_canonical_format:
        csr = csr.copy()
        csr.sum_duplicates()
    return csr


def as_csr(A: Any) -> sp.csr_array:
    """A square matrix of finite numbers, sparse or dense, in compressed rows; see :func:`canonical`.

    Raises MatrixError if it is none.
    """
    kind = f"an object of type {type(A).__name__}"
    try:
        A = A if sp.issparse(A) else np.asarray(A)
    except Exception as error:  # foreign types convert with any exception they like
        raise MatrixError(f"{kind} cannot be taken for a matrix ({error})") from error
    if A.dtype.kind not in "biufc":
        raise MatrixError(
            f"{kind}, with entries of type {A.dtype}, is not a matrix of numbers: pass a scipy sparse matrix, a numpy "
            "array or a path"
        )
    if A.ndim != 2:
        raise MatrixError(f"a matrix has two dimensions, not {A.ndim}")
    rows, columns = A.shape
    if rows != columns:
        raise MatrixError(f"the matrix is not square: it has {count_of(rows, 'row')} and {count_of(columns, 'column')}")
    if rows == 0:
        raise MatrixError("the matrix is empty: it has 0 rows")
    if A.dtype.kind == "b":
        raise MatrixError(
            "the matrix has a pattern only (its type is bool) and no numbers: the shape of the mesh is in the "
            "numbers, so pass the matrix with its values"
        )
    csr = canonical(A if sp.issparse(A) else _stored(A))
    finite = np.isfinite(csr.data)
    if not finite.all():
        i, j = place(csr, int(np.argmin(finite)))
        more = int(len(finite) - np.count_nonzero(finite) - 1)
        others = f" (and {count_of(more, 'more entry is', 'more entries are')} not finite)" if more else ""
        raise MatrixError(
            f"the entry at row {i}, column {j} is {csr[i, j]}{others}: every entry must be a finite number"
        )
    return csr


def _stored(dense: NDArray) -> sp.coo_array:
    """What is not zero."""
    at = np.nonzero(dense)
    with np.errstate(over="ignore"):  # as in :func:`canonical`; scipy knows no long doubles
        return sp.coo_array((dense[at].astype(working_dtype(dense.dtype), copy=False), at), shape=dense.shape)


def entry_rows(csr: sp.csr_array) -> NDArray:
    """(nnz,) row of each stored entry."""
    return np.repeat(np.arange(csr.shape[0], dtype=csr.indices.dtype), np.diff(csr.indptr))


def place(csr: sp.csr_array, k: int) -> tuple[int, int]:
    """Row and column of the k-th stored entry."""
    return int(np.searchsorted(csr.indptr, k, side="right")) - 1, int(csr.indices[k])


def inconsistency(A: Any) -> str | None:
    """What is wrong with the index arrays, in scipy's words; None where nothing is.

    Compiled code trusts these arrays: a wrong one reads or writes outside its memory.
    """
    try:
        if A.format == "coo":
            sp.coo_array((A.data, A.coords), shape=A.shape)
        elif A.format in ("csr", "csc", "bsr"):
            type(A)((A.data, A.indices, A.indptr), shape=A.shape).check_format(full_check=True)
    except (ValueError, TypeError, AttributeError) as error:  # of arrays of another kind, or none
        return str(error)
    return None


def working_dtype(dtype: np.dtype) -> type:
    """The type that entries of another one are converted to: bool, float64 or complex128."""
    return {"b": np.bool_, "c": np.complex128}.get(dtype.kind, np.float64)
