"""Sparse least squares whose error grows with the condition of the matrix, not with its square.

References
----------
Bjorck, "Iterative refinement of linear least squares solutions I", BIT 7, 1967.
Arioli, Duff, de Rijk, "On the augmented system approach to sparse least-squares problems", Numerische Mathematik 55,
1989.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from ..errors import SolverError
from .columns import with_unit_columns


class AugmentedSystem:
    """Solves min |B x - r| by way of [w I, B; B', 0] [s; x] = [r; 0], whose s is the residual over w.

    Factorised by SuperLU with partial pivoting: PARDISO's pivots, from within a supernode, lose more digits here than
    normal equations do.

    Parameters
    ----------
    matrix : (m, k) sparse
        B, of full column rank.

    Raises
    ------
    SolverError
        If the rank is not full to working accuracy, or entries are not finite.
    """

    weight = 2.0**-20
    """w: the least singular value would be best, but partial pivoting serves for all that are not far above it."""

    def __init__(self, matrix: sp.csr_array):
        self._matrix, self._unit = with_unit_columns(matrix)
        rows = matrix.shape[0]
        system = sp.block_array(
            [[self.weight * sp.eye_array(rows), self._matrix], [self._matrix.T, None]], format="csc"
        )
        try:
            self._factor = splu(system, diag_pivot_thresh=1.0)
        except RuntimeError as error:
            raise SolverError(f"SuperLU could not go on with a matrix of order {sum(matrix.shape)}: {error}") from error

    def solve(self, right: NDArray) -> NDArray[np.float64]:
        """x (k,) for r (m,), with one step of iterative refinement."""
        b, rows = self._matrix, len(right)
        found = np.zeros(sum(b.shape))
        for _ in range(2):
            s, x = found[:rows], found[rows:]
            found = found + self._factor.solve(np.concatenate([right - self.weight * s - b @ x, -(b.T @ s)]))
        return np.asarray(self._unit * found[rows:])

    def release(self) -> None:
        """Give the memory of the factor back."""
        del self._factor
