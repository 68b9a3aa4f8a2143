"""Hermitian sparse matrices stored by their upper triangle."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class UpperTriangle:
    """Upper triangle, diagonal included, of a Hermitian (or real symmetric) matrix in CSR form.

    Raises ValueError if a row does not start with its diagonal, or its columns do not increase: PARDISO would write
    beyond its memory.
    """

    data: NDArray  # (nnz,) float64 or complex128, or (nnz, b, b) float64 blocks, those of the diagonal stored whole
    indices: NDArray[np.int32]  # (nnz,) columns, increasing within a row and starting with the diagonal
    indptr: NDArray[np.int32]  # (n + 1,)

    def __post_init__(self) -> None:
        # PARDISO reads these arrays as they lie in memory: anything but 32-bit integers would crash it.
        for name in ("indices", "indptr"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=np.int32))
        start = self.indptr[:-1]
        wrong = start == self.indptr[1:]
        wrong[~wrong] = self.indices[start[~wrong]] != np.flatnonzero(~wrong)
        if wrong.any():
            raise ValueError(
                f"row {int(np.argmax(wrong))} of the upper triangle does not start with its diagonal entry"
            )
        falls = np.diff(self.indices) <= 0
        falls[start[1:] - 1] = False
        if falls.any() or (len(self.indices) and self.indices.max() >= self.n):
            raise ValueError("the columns in a row of the upper triangle repeat one, or do not increase to the last")

    @classmethod
    def of(cls, matrix: sp.csr_array | sp.bsr_array) -> UpperTriangle:
        """Of a whole matrix, whose diagonal has to be stored; blocks where it is in BSR form."""
        if matrix.format == "csr":
            upper = sp.csr_array(sp.triu(matrix, format="csr"))
            upper.sort_indices()
            return cls(upper.data, upper.indices, upper.indptr)
        n = len(matrix.indptr) - 1
        row = np.repeat(np.arange(n, dtype=np.int32), np.diff(matrix.indptr))
        kept = np.flatnonzero(matrix.indices >= row)
        indptr = np.append(0, np.cumsum(np.bincount(row[kept], minlength=n)))
        half = sp.bsr_array((matrix.data[kept], matrix.indices[kept], indptr), shape=matrix.shape)
        half.sort_indices()
        return cls(half.data, half.indices, half.indptr)

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
        other = copy(self)  # whose pattern needs no second look
        object.__setattr__(other, "data", data)
        return other

    def full(self) -> sp.csc_array:
        """Both triangles."""
        order = self.n * self.block
        if self.block == 1:
            upper = sp.csr_array((self.data, self.indices, self.indptr), shape=(order, order))
        else:
            upper = sp.triu(sp.bsr_array((self.data, self.indices, self.indptr), shape=(order, order)), format="csr")
        return (upper + sp.triu(upper, 1).conj().T).tocsc()


def upper_from_edges(n: int, edges: NDArray, off_diagonal: NDArray, diagonal: NDArray) -> UpperTriangle:
    """The triangle with some entries off the diagonal, (e,), and on it, (n,).

    `edges` (e, 2): pairs i < j in lexicographic order, without repetition.
    """
    count = np.bincount(edges[:, 0], minlength=n)
    start = np.cumsum(count) - count  # each row starts with its diagonal
    data = np.insert(off_diagonal.astype(np.result_type(off_diagonal, diagonal), copy=False), start, diagonal)
    return UpperTriangle(data, np.insert(edges[:, 1], start, np.arange(n)), np.append(0, np.cumsum(count + 1)))
