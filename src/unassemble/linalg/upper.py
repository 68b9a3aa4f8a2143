"""Hermitian sparse matrices stored by their upper triangle."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class UpperTriangle:
    """Upper triangle, diagonal included, of a Hermitian (or real symmetric) matrix in CSR form.

    Attributes
    ----------
    data : (nnz,) float64 or complex128, or (nnz, b, b) float64
        Entries, or blocks of b x b entries; diagonal blocks are stored whole.
    indices : (nnz,) int32
        Columns, increasing within a row and starting with the diagonal, which is always stored.
    indptr : (n + 1,) int32

    Raises
    ------
    ValueError
        If a row does not start with its diagonal: PARDISO would crash on it.
    """

    data: NDArray
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]

    def __post_init__(self) -> None:
        # PARDISO reads these arrays as they lie in memory: anything but 32-bit integers would crash it.
        for name in ("indices", "indptr"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=np.int32))
        self._check_diagonal()

    def _check_diagonal(self) -> None:
        start = self.indptr[:-1]
        if len(self.indices):
            first = self.indices[np.minimum(start, len(self.indices) - 1)]
            wrong = (first != np.arange(self.n)) | (start == self.indptr[1:])
        else:
            wrong = np.ones(self.n, dtype=bool)
        if wrong.any():
            raise ValueError(
                f"row {int(np.argmax(wrong))} of the upper triangle does not start with its diagonal entry"
            )

    @classmethod
    def of(cls, matrix: sp.csr_array | sp.bsr_array) -> UpperTriangle:
        """Of a whole matrix, whose diagonal has to be stored; blocks where it is in BSR form."""
        if matrix.format == "csr":
            upper = sp.csr_array(sp.triu(matrix, format="csr"))
            upper.sort_indices()
            return cls(upper.data, upper.indices, upper.indptr)
        matrix.sort_indices()
        n = len(matrix.indptr) - 1
        row = np.repeat(np.arange(n), np.diff(matrix.indptr))
        upper = matrix.indices >= row
        indptr = np.concatenate([[0], np.cumsum(np.bincount(row[upper], minlength=n))])
        return cls(np.ascontiguousarray(matrix.data[upper]), matrix.indices[upper], indptr)

    @property
    def n(self) -> int:
        """Order of the matrix, counted in entries or in blocks."""
        return len(self.indptr) - 1

    @property
    def block(self) -> int:
        """Order of the blocks."""
        return 1 if self.data.ndim == 1 else self.data.shape[1]

    def with_data(self, data: NDArray) -> UpperTriangle:
        """The same pattern with other entries."""
        return replace(self, data=data)

    def full(self) -> sp.csc_array:
        """Both triangles."""
        order = self.n * self.block
        if self.block == 1:
            upper = sp.csr_array((self.data, self.indices, self.indptr), shape=(order, order))
        else:
            upper = sp.triu(sp.bsr_array((self.data, self.indices, self.indptr), shape=(order, order)), format="csr")
        return (upper + sp.triu(upper, 1).conj().T).tocsc()


def upper_from_edges(n: int, edges: NDArray, off_diagonal: NDArray, diagonal: NDArray) -> UpperTriangle:
    """Build the triangle from an edge list.

    Parameters
    ----------
    n : int
        Order of the matrix.
    edges : (e, 2) int
        Pairs i < j in lexicographic order, without repetition.
    off_diagonal : (e,) float64 or complex128
        Entries at (i, j).
    diagonal : (n,) float64 or complex128
    """
    count = np.bincount(edges[:, 0], minlength=n) + 1
    indptr = np.zeros(n + 1, dtype=np.int32)
    np.cumsum(count, out=indptr[1:])
    is_diagonal = np.zeros(len(edges) + n, dtype=bool)
    is_diagonal[indptr[:-1]] = True
    indices = np.empty(len(edges) + n, dtype=np.int32)
    indices[is_diagonal] = np.arange(n, dtype=np.int32)
    indices[~is_diagonal] = edges[:, 1]
    data = np.empty(len(edges) + n, dtype=np.result_type(off_diagonal, diagonal))
    data[is_diagonal] = diagonal
    data[~is_diagonal] = off_diagonal
    return UpperTriangle(data, indices, indptr)
