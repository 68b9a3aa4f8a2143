"""Ranks of the Jacobian and of its blocks (paper, section 3.2), by dense singular values."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unassemble.paper import AngleSystem


class Ranks:
    """Ranks at one point; singular values below `threshold` times the greatest are zero.

    Each is computed when it is asked for, and once.

    Parameters
    ----------
    system : AngleSystem
        Equations.
    x : (n_unknowns,) ndarray
        Where the Jacobian is taken.
    threshold : float
        Relative to the greatest singular value of the same rows.
    """

    def __init__(self, system: AngleSystem, x: NDArray, *, threshold: float = 1e-9):
        self._system, self._threshold = system, threshold
        self._matrix = system.jacobian(x).sparse().toarray()

    @cached_property
    def edges(self) -> int:
        """Rank of the rows (1)-(2)."""
        return len(self._kept(self._matrix[self._system.row_of_edges : self._system.row_of_loops]))

    @cached_property
    def linear(self) -> int:
        """Rank of the rows (3)-(4)."""
        return len(self._kept(self._matrix[: self._system.row_of_edges]))

    @cached_property
    def _whole(self) -> NDArray[np.float64]:
        return self._kept(self._matrix)

    @property
    def deficiency(self) -> int:
        """Unknowns less the rank of all rows."""
        return self._system.n_unknowns - len(self._whole)

    @property
    def least(self) -> float:
        """The least singular value of all rows that counts."""
        return float(self._whole[-1])

    def _kept(self, rows: NDArray) -> NDArray[np.float64]:
        values = np.linalg.svd(rows, compute_uv=False)
        return values[values > self._threshold * values[0]]
