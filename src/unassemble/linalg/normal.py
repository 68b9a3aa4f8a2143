"""Sparse least squares by normal equations, whose error the caller takes off by steps with residuals of his own.

References
----------
Bjorck, "Stability analysis of the method of seminormal equations for linear least squares problems", Linear Algebra
and its Applications 88/89, 1987.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import SolverError
from .columns import with_unit_columns
from .factorisation import factorisation
from .upper import UpperTriangle


class NormalEquations:
    """Solves B' B x = B' r, with columns of length 1.

    Parameters
    ----------
    matrix : (m, k) sparse
        B, of full column rank.

    Raises
    ------
    SolverError
        If the rank is not full to the square root of working accuracy, or entries are not finite.
    """

    def __init__(self, matrix: sp.csr_array):
        scaled, self._unit = with_unit_columns(matrix)
        self._transposed = sp.csr_array(scaled.T)
        normal = UpperTriangle.of(sp.csr_array(self._transposed @ self._transposed.T))
        self._factor = factorisation(normal, definite=True)
        try:
            self._factor.factorise(normal)
        except SolverError:
            self._factor.release()
            raise

    def solve(self, right: NDArray) -> NDArray[np.float64]:
        """x (k,) for r (m,)."""
        return np.asarray(self._unit * self._factor.solve(self._transposed @ right))

    def release(self) -> None:
        """Give the memory of the factor back."""
        self._factor.release()
