"""The few entries, if any, without which a mesh would fit all others.

Least squares spread a wrong entry's misfit over its neighbours, and the largest misfit may be next to it. But the sum
of squares that leaving an entry k out would save is r_k^2 / (1 - h_kk), with r the misfit and H the projector onto the
range of the derivative: if k is the only wrong entry this is all of it, and no other entry saves as much
(Cauchy-Schwarz). Further entries follow by orthogonalisation, as in a forward selection of regressors.

References
----------
Cook, Weisberg, "Residuals and Influence in Regression", Chapman and Hall 1982.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from ..errors import SolverError
from ..topology import Piece
from .cotangent import edge_weights
from .normal import NormalEquations, WeightJacobian, distant_pair
from .polish import SHORT, polish


@dataclass(frozen=True)
class SuspectOptions:
    """Settings of the selection."""

    candidates: int = 48  # entries of the largest misfit, among which those that stand out are looked for
    most: int = 8  # entries that are left out
    # share of the sum of squares at which nothing is left to explain: derivatives are no longer accurate
    enough: float = 1e-6
    # an entry is suspect if leaving it out saves this many times the mean square of what is left
    least_ratio: float = 30.0


@dataclass(frozen=True, eq=False)
class Suspects:
    """Entries that stand out."""

    edges: NDArray[np.int64]  # (k,) edges of the piece, the one that saves most first
    left: float  # share of the sum of squares that remains without them
    size: float  # root of the sum of squares that leaving them out saves, in units of the weights (divided by `spread`)
    # natural logarithm of the probability, at most, that normal errors let so few entries stand out so far
    log_p: float


_OPTIONS = SuspectOptions()


def find_suspects(
    piece: Piece, weights: NDArray, z: NDArray, scale: float, spread: NDArray | None, *, free_scale: bool
) -> Suspects:
    """Entries that stand out from the misfit of the others.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij.
    z : (n,) complex128
    scale : float
        c.
    spread : (e,) float64, optional
        Standard deviations of the weights up to a factor; 1 by default.
    free_scale : bool
        Whether c was fitted.
    """
    spread = np.ones(len(weights)) if spread is None else spread
    jacobian = WeightJacobian(piece, z, spread)
    equations = NormalEquations(jacobian, distant_pair(z))
    fitted = edge_weights(piece, z) / spread
    rest = Complement(jacobian, equations, fitted if free_scale else None)
    misfit = rest(weights[:, None] / scale / spread[:, None] - fitted[:, None])[:, 0]
    candidates = np.argsort(-np.abs(misfit), kind="stable")[: _OPTIONS.candidates]
    columns = np.zeros((len(weights), len(candidates)))
    columns[candidates, np.arange(len(candidates))] = 1
    columns = rest(columns)
    equations.release()
    freedom = len(weights) - 2 * piece.n_vertices + 4 - free_scale
    chosen, left = _forward(misfit, columns, freedom)
    size = float(np.linalg.norm(misfit)) * np.sqrt(1 - left)
    return Suspects(candidates[chosen], left, size, _log_probability(len(weights), len(chosen), left, freedom))


def _log_probability(entries: int, chosen: int, left: float, freedom: int) -> float:
    """By an F test, times the number of ways to choose (Bonferroni)."""
    if not chosen:
        return 0.0
    with np.errstate(divide="ignore"):
        ratio = np.float64((1 - left) / chosen) / np.float64(left / (freedom - chosen))
        return min(0.0, chosen * np.log(entries) + float(np.log(fdtrc(chosen, freedom - chosen, ratio))))


def _forward(misfit: NDArray, columns: NDArray, freedom: int) -> tuple[list[int], float]:
    """Columns that explain most of the misfit, one after the other, while they stand out."""
    total = left = float(misfit @ misfit)
    chosen: list[int] = []
    norms = np.sum(columns**2, axis=0)
    floor = 1e-6 * norms  # an entry that the others fix says nothing about itself
    while left > _OPTIONS.enough * total and len(chosen) < min(_OPTIONS.most, freedom - 1):
        with np.errstate(divide="ignore", invalid="ignore"):
            saved = np.where(norms > floor, (misfit @ columns) ** 2 / norms, 0.0)
        k = int(saved.argmax())
        remaining = max(left - float(saved[k]), 0.0)
        if saved[k] <= _OPTIONS.least_ratio * remaining / (freedom - len(chosen) - 1):
            break
        chosen.append(k)
        left = remaining
        direction = columns[:, k] / np.sqrt(norms[k])
        misfit = misfit - direction * (direction @ misfit)
        columns = columns - direction[:, None] * (direction @ columns)
        norms = np.sum(columns**2, axis=0)
    return chosen, left / total if total > 0 else 0.0


def differences_without(
    piece: Piece, weights: NDArray, z: NDArray, scale: float, aside: NDArray[np.int64], *, free_scale: bool
) -> NDArray[np.float64]:
    """(e,) what the mesh that is fitted to all entries but a few leaves of each weight; 0 for these few.

    Infinite where there is no such mesh.

    `aside` (k,): edges of the piece; the others as for :func:`find_suspects`.
    """
    spread = np.abs(weights) + np.median(np.abs(weights))
    spread[aside] *= 1e6  # they count where nothing else holds a vertex
    try:
        with np.errstate(all="ignore"):
            found = polish(piece, weights, z, scale=None if free_scale else scale, spread=spread, options=SHORT)
            left = weights - found.scale * edge_weights(piece, found.z)
    except SolverError:
        return np.full(len(weights), np.inf)
    left[aside] = 0.0
    return np.where(np.isfinite(left), left, np.inf)


class Complement:
    """The projector I - H off what displacements, and a change of scale, can explain."""

    def __init__(self, jacobian: WeightJacobian, equations: NormalEquations, weights: NDArray | None):
        self._jacobian, self._equations = jacobian, equations
        self._direction = None
        if weights is not None:
            rest = self._off_range(weights[:, None])[:, 0]
            size = float(np.linalg.norm(rest))
            self._direction = rest / size if size > 0 else None

    def __call__(self, changes: NDArray) -> NDArray:
        """(e, k) -> (e, k)."""
        changes = self._off_range(changes)
        if self._direction is None:
            return changes
        return changes - self._direction[:, None] * (self._direction @ changes)

    def _off_range(self, changes: NDArray) -> NDArray:
        gradients = np.column_stack([self._jacobian.transpose(column) for column in changes.T])
        moves = self._equations.solve(gradients)
        return changes - np.column_stack([self._jacobian.forward(np.ascontiguousarray(move)) for move in moves.T])
