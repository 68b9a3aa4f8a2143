"""What a polish minimises: the misfit of a mesh with given positions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..tolerances import LAST_DIGITS
from ..topology import Piece
from .cotangent import edge_weights
from .normal import Jacobian, WeightJacobian


class Model(Protocol):
    """Weights of a mesh as a function of its positions, with their derivative."""

    def weights(self, z: NDArray) -> NDArray[np.float64]:
        """(e,) w for positions z (n,) complex; not finite where cells are flat."""

    def jacobian(self, z: NDArray, spread: NDArray) -> Jacobian:
        """dw / d(x, y), each row divided by the standard deviation of its weight."""


@dataclass(frozen=True, eq=False)
class Cotangents:
    """The weights of linear triangles."""

    piece: Piece

    def weights(self, z: NDArray) -> NDArray[np.float64]:
        """See :func:`.cotangent.edge_weights`."""
        return edge_weights(self.piece, z)

    def jacobian(self, z: NDArray, spread: NDArray) -> Jacobian:
        """See :class:`.normal.WeightJacobian`."""
        return WeightJacobian(self.piece, z, spread)


@dataclass(frozen=True, eq=False)
class Fit:
    """A mesh held against the matrix; weights and misfit a / c - w are divided by their standard deviations."""

    z: NDArray[np.complex128]
    scale: float
    weights: NDArray[np.float64]
    misfit: NDArray[np.float64]

    @property
    def norm(self) -> float:
        """Root of the sum of squares of a - c w: what is minimised, while that of a / c - w falls as c grows."""
        return float(np.linalg.norm(self.misfit)) * abs(self.scale)

    @property
    def noise(self) -> float:
        """Standard deviation of noise in the weights that would leave this misfit."""
        return float(np.linalg.norm(self.misfit)) / np.sqrt(max(len(self.misfit) - 2 * len(self.z) + 3, 1))


@dataclass(frozen=True, eq=False)
class Problem:
    """What is to be fitted."""

    model: Model
    weights: NDArray[np.float64]
    spread: NDArray[np.float64]
    scale: float | None

    def at(self, z: NDArray) -> Fit:
        """The fit of positions z, with the best c where none is given."""
        with np.errstate(divide="ignore", invalid="ignore"):  # a flat triangle makes the misfit infinite
            w, a = self.model.weights(z) / self.spread, self.weights / self.spread
            c = float(w @ a / (w @ w)) if self.scale is None else self.scale
            return Fit(z, c, w, a / c - w)


def downhill(problem: Problem, fit: Fit, move: NDArray) -> Fit | None:
    """The longest of the step, its half, its quarter, ... that does not raise the misfit."""
    rounding = LAST_DIGITS * abs(fit.scale) * float(np.linalg.norm(fit.weights))
    for halvings in range(12):
        trial = problem.at(fit.z + move * 0.5**halvings)
        if trial.norm <= fit.norm + rounding:
            return trial
    return None
