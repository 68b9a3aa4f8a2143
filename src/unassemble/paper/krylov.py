"""What the Krylov methods of this room share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class LinearMap(Protocol):
    """A matrix known by its products."""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows, columns."""

    def forward(self, step: NDArray) -> NDArray:
        """J s."""

    def adjoint(self, residual: NDArray) -> NDArray:
        """J^T r."""


@dataclass(frozen=True, eq=False)
class KrylovResult:
    """Where an inner iteration stopped.

    Attributes
    ----------
    step : (n,) float64
    steps : int
        Each takes one product with J and one with its transpose.
    converged : bool
        False if it broke down or spent its steps.
    """

    step: NDArray[np.float64]
    steps: int
    converged: bool
