"""The linearised problem for long thin pieces, without normal equations.

A piece n elements long and few wide bends like a beam: J has condition n^2 and J'J n^4, which from some thousand
elements on leaves the bending of normal equations' solutions to chance.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..linalg import AugmentedSystem
from .normal import WeightJacobian

_WORK = 2e7  # vertices times the square of the width: about a second per factorisation


class PivotedEquations:
    """The interface of :class:`~unassemble.planar.normal.NormalEquations`, which serves one Jacobian at a time.

    Parameters
    ----------
    jacobian : WeightJacobian
    pins : (2,) int
        Vertices that stay where they are.

    Raises
    ------
    SolverError
    """

    def __init__(self, jacobian: WeightJacobian, pins: NDArray):
        free = np.ones(jacobian.n, dtype=bool)
        free[pins] = False
        self._columns = np.flatnonzero(np.repeat(free, 2))
        self._n = jacobian.n
        self.renew(jacobian)

    def renew(self, jacobian: WeightJacobian) -> None:
        """Factorise anew for other positions."""
        self._system = AugmentedSystem(sp.csr_array(jacobian.matrix.tocsc()[:, self._columns]))

    def fitted(self, _: WeightJacobian, change: NDArray) -> NDArray:
        """Displacement d (n,) complex that explains a change (e,) of the weights best: least |J d - r|."""
        move = np.zeros(2 * self._n)
        move[self._columns] = self._system.solve(change)
        return move.view(np.complex128)

    def release(self) -> None:
        """Nothing is kept outside Python's memory."""


def affordable(edges: NDArray, z: NDArray) -> bool:
    """Whether a piece is small, or long and thin, so that a factor with partial pivoting has few entries."""
    length = np.abs(np.diff(z[edges], axis=1)).mean()
    width = len(z) * length / np.abs(z - z.mean()).max() / 2
    return bool(len(z) * width**2 <= _WORK)
