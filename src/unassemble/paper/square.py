"""A square system by picking interior equations (paper, section 3.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .krylov import LinearMap


@dataclass(frozen=True, eq=False)
class Picked:
    """Some of the rows of a Jacobian.

    Attributes
    ----------
    matrix : LinearMap
    rows : (k,) int64
    """

    matrix: LinearMap
    rows: NDArray[np.int64]

    @property
    def shape(self) -> tuple[int, int]:
        """Picked rows, unknowns."""
        return len(self.rows), self.matrix.shape[1]

    def forward(self, step: NDArray) -> NDArray:
        """The picked rows of J s."""
        return self.matrix.forward(step)[self.rows]

    def adjoint(self, residual: NDArray) -> NDArray:
        """J^T r for r that lives on the picked rows."""
        full = np.zeros(self.matrix.shape[0])
        full[self.rows] = residual
        return self.matrix.adjoint(full)


def square_rows(shape: tuple[int, int], first: int, last: int) -> NDArray[np.int64]:
    """Rows of a square system, short of surplus rows taken from the end of the block [first, last).

    With the block of (4) this is the paper's choice. At the solution the squared side lengths of the mesh give a
    combination of the rows (1)-(3) alone that vanishes, so that the system stays singular whichever
    interior equations are left out; leaving out one of (1)-(2) instead removes the dependence.

    Raises
    ------
    InputError
        If there are fewer equations than unknowns, or the block is too short.
    """
    surplus = shape[0] - shape[1]
    if surplus < 0 or surplus > last - first:
        raise InputError(
            f"{shape[0]} equations for {shape[1]} unknowns: no square system can be picked from rows {first} to "
            f"{last - 1}; take a least-squares method (cgls, lsqr)"
        )
    return np.r_[0 : last - surplus, last : shape[0]].astype(np.int64)
