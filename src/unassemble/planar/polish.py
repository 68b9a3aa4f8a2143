"""Gauss-Newton on the coordinates: the maximum-likelihood mesh for noise in the matrix entries.

Minimises sum_e (c w_e(z) - a_e)^2 over positions z and, where it is unknown, the scale c; a_e = -A_ij.
The conformal null vector starts inside the basin, so one factorisation of J'J at the start
serves all steps (a chord iteration) as long as they contract.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece
from .cotangent import edge_weights
from .normal import NormalEquations, WeightJacobian, distant_pair

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class PolishOptions:
    """Settings of the iteration; lengths are relative to the mesh's extent.

    Attributes
    ----------
    max_steps, max_factorisations : int
    tolerance : float
        A step below this ends the iteration.
    rounding : float
        Below this a step that does not contract is taken for rounding.
    contraction : float
        A step longer than this times the one before asks for a new factorisation.
    """

    max_steps: int = 40
    max_factorisations: int = 8
    tolerance: float = 5e-16
    rounding: float = 1e-10
    contraction: float = 0.2


@dataclass(frozen=True, eq=False)
class PolishedMesh:
    """Result of :func:`polish`.

    Attributes
    ----------
    z : (n,) complex128
    scale : float
    residual : float
        Root of the sum of squares of c w - a.
    steps, factorisations : int
    converged : bool
        Whether steps fell to rounding level.
    """

    z: NDArray[np.complex128]
    scale: float
    residual: float
    steps: int
    factorisations: int
    converged: bool


def polish(
    piece: Piece,
    weights: NDArray,
    z: NDArray,
    *,
    scale: float | None = None,
    options: PolishOptions | None = None,
) -> PolishedMesh:
    """Improve positions to the level that the entries allow.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        a = -A_ij of each edge.
    z : (n,) complex128
        Start, for instance of :func:`~unassemble.planar.conformal.conformal_map`.
    scale : float, optional
        c, where it is known; otherwise it is fitted.
    options : PolishOptions, optional
    """
    options = options or PolishOptions()
    extent = np.abs(z - z.mean()).max()
    z = (z - z.mean()) / extent
    pins = distant_pair(z)
    fit = _Fit.at(piece, weights, z, scale)
    system: _GaussNewton | None = None
    factorisations, steps, length, converged = 0, 0, np.inf, False
    while steps < options.max_steps and not converged:
        jacobian = WeightJacobian(piece, fit.z)
        fresh = system is None
        if system is None:
            system = _GaussNewton(jacobian, pins, fit.weights, free_scale=scale is None)
            factorisations += 1
        move = system.step(jacobian, fit.misfit)
        previous, length = length, float(np.abs(move).max())
        slow = length > options.contraction * previous
        if slow and length > options.rounding and not fresh:
            if factorisations == options.max_factorisations:
                break
            system.release()
            system, length = None, np.inf
            continue
        better = _downhill(piece, weights, fit, move, scale)
        steps += 1
        _log.debug("polish step %d: length %.1e, misfit %.3e", steps, length, fit.norm)
        # A step that no longer lowers the misfit is rounding, or an end that is not the mesh.
        converged = length <= options.tolerance or ((slow or better is None) and length <= options.rounding)
        if better is None and not converged:
            break
        fit = better or fit
    if system is not None:
        system.release()
    return PolishedMesh(fit.z * extent, fit.scale, fit.norm * abs(fit.scale), steps, factorisations, converged)


@dataclass(frozen=True, eq=False)
class _Fit:
    """A mesh held against the matrix."""

    z: NDArray[np.complex128]
    scale: float
    weights: NDArray[np.float64]
    misfit: NDArray[np.float64]

    @classmethod
    def at(cls, piece: Piece, weights: NDArray, z: NDArray, scale: float | None) -> _Fit:
        """Weights of positions z, the best c where none is given, and a / c - w."""
        with np.errstate(divide="ignore", invalid="ignore"):  # a flat triangle makes the misfit infinite
            w = edge_weights(piece, z)
            c = float(w @ weights / (w @ w)) if scale is None else scale
            return cls(z, c, w, weights / c - w)

    @property
    def norm(self) -> float:
        """Root of the sum of squares of the misfit."""
        return float(np.linalg.norm(self.misfit))


def _downhill(piece: Piece, weights: NDArray, fit: _Fit, move: NDArray, scale: float | None) -> _Fit | None:
    """The longest of the step, its half, its quarter, ... that does not raise the misfit."""
    rounding = 1e-14 * float(np.linalg.norm(fit.weights))
    for halvings in range(12):
        trial = _Fit.at(piece, weights, fit.z + move * 0.5**halvings, scale)
        if trial.norm <= fit.norm + rounding:
            return trial
    return None


class _GaussNewton:
    """Steps of the linearised problem min |J d + g w - r| over displacements d and log-scale g."""

    def __init__(self, jacobian: WeightJacobian, pins: NDArray, weights: NDArray, *, free_scale: bool):
        self._equations = NormalEquations(jacobian, pins)
        self._weights = weights if free_scale else None
        if free_scale:
            self._slope = jacobian.transpose(weights)
            self._response = self._equations.solve(self._slope)
            # What J cannot explain of w; zero would mean that c and the shape are confounded.
            self._complement = float(weights @ weights) - _dot(self._slope, self._response)

    def step(self, jacobian: WeightJacobian, misfit: NDArray) -> NDArray:
        """Displacement d (n,) complex; the scale follows from it by least squares."""
        move = self._equations.solve(jacobian.transpose(misfit))
        if self._weights is None or self._complement <= 0:
            return move
        log_scale = (float(self._weights @ misfit) - _dot(self._slope, move)) / self._complement
        return move - log_scale * self._response

    def release(self) -> None:
        """Give the memory of the factor back."""
        self._equations.release()


def _dot(a: NDArray, b: NDArray) -> float:
    """Inner product of displacements as real vectors."""
    return float(np.vdot(a, b).real)
