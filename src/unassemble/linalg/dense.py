"""LAPACK, for orders at which a sparse factorisation takes longer to set up than a dense one to finish."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, get_lapack_funcs

from ..errors import SolverError
from .upper import UpperTriangle


class DenseFactorisation:
    """The same interface as :class:`~unassemble.linalg.pardiso.PardisoFactorisation`.

    Gaussian elimination with partial pivoting, or Cholesky for matrices that are to be definite.
    """

    def __init__(self, matrix: UpperTriangle, *, definite: bool = False):
        dtype = np.complex128 if np.iscomplexobj(matrix.data) else np.float64
        self._dtype, self._definite = dtype, definite
        self._getrf, self._getrs = get_lapack_funcs(("getrf", "getrs"), dtype=dtype)

    @staticmethod
    def suits(matrix: UpperTriangle) -> bool:
        """Whether a matrix is so small that this is faster than PARDISO; entries out of proportion do it no harm."""
        return matrix.n * matrix.block <= 200

    def factorise(self, matrix: UpperTriangle) -> None:
        """Factorise."""
        if not np.isfinite(matrix.data).all():
            raise SolverError("a matrix to be factorised has entries that are not finite")
        whole = self._whole(matrix)
        if self._definite:
            try:
                self._factor = cho_factor(whole, lower=False, check_finite=False)
            except LinAlgError as error:
                raise SolverError(f"a matrix of order {len(whole)} is not positive definite: {error}") from error
            return
        lu, pivots, info = self._getrf(whole)
        if info:
            raise SolverError(f"LAPACK could not go on with a matrix of order {len(whole)}: a pivot is zero")
        self._factor = lu, pivots

    def _whole(self, matrix: UpperTriangle) -> NDArray:
        """The matrix as a dense one; of definite ones the upper triangle is enough."""
        b, n = matrix.block, matrix.n
        row = np.repeat(np.arange(n), np.diff(matrix.indptr))
        blocks = np.zeros((n, b, n, b), dtype=self._dtype)
        blocks[row, :, matrix.indices] = matrix.data.reshape(-1, b, b)
        whole = blocks.reshape(n * b, n * b)
        if self._definite:
            return whole
        above = np.triu(whole, 1)
        return above + np.triu(whole).conj().T

    def solve(self, rhs: NDArray) -> NDArray:
        """Solve for one right-hand side (n,) or several (n, k)."""
        rhs = np.asarray(rhs, dtype=self._dtype)
        if self._definite:
            return np.asarray(cho_solve(self._factor, rhs, check_finite=False))
        return np.asarray(self._getrs(*self._factor, rhs)[0])

    def release(self) -> None:
        """Give the memory of the factor back."""
        self.__dict__.pop("_factor", None)
