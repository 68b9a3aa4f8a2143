"""Gauss-Newton on the coordinates: the maximum-likelihood mesh for noise in the matrix entries.

Minimises sum_e ((c w_e(z) - a_e) / s_e)^2 over positions z and, where it is unknown, the scale c; a_e = -A_ij, and
s_e is the standard deviation of its error up to a common factor.
The conformal null vector starts inside the basin, so one factorisation of J'J at the start serves all steps (a chord
iteration) as long as they contract. Starts that noise has bent too far for that take a factorisation for each step, and
no triangle is turned over on the way: cotangents have poles where triangles are flat, so that a step which turns one
over may lower the misfit and still lead away.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import SolverError
from ..tolerances import LAST_DIGITS, ROUNDED
from ..topology import Piece
from .cotangent import areas, edge_weights, weight_roundings
from .normal import GaussNewton, Jacobian, NormalEquations, WeightJacobian, distant_pair

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class PolishOptions:
    """Settings of the iteration; lengths are relative to the mesh's extent."""

    max_steps: int = 40
    max_factorisations: int = 8
    tolerance: float = 5e-16  # the iteration ends when the next step is expected to be below this
    rounding: float = 1e-10  # below this a step that does not contract is taken for rounding
    contraction: float = 0.2  # a step longer than this times the one before asks for a new factorisation
    # the iteration also ends when a step changes the fitted weights by less than this times the noise that the misfit
    # shows: the mesh then moves by as small a part of its error bars
    settled: float = 1e-3
    most_vertices: int = 1_500_000  # the factor of larger meshes takes more memory than most machines have
    # a factorisation for each step, solved until rounding of the normal equations is gone, and cut short before a
    # triangle turns over
    careful: bool = False


SHORT = PolishOptions(max_steps=8, max_factorisations=3)
"""Where only the right cells, or the right entries set aside, are worth more."""

CAREFUL = PolishOptions(careful=True)
MOST_CAREFUL = 200_000
"""Vertices of a piece for which so many factorisations are worth their time."""


@dataclass(frozen=True, eq=False)
class PolishedMesh:
    """Result of :func:`polish`."""

    z: NDArray[np.complex128]  # (n,)
    scale: float
    residual: float  # root of the sum of squares of (c w - a) / s
    factorisations: int
    converged: bool  # whether steps fell to rounding level
    # length of the last step that was computed, relative to the mesh's extent: about the error that remains
    last_step: float


class Model(Protocol):
    """Weights of a mesh as a function of positions z, (n,) complex, with their derivative."""

    n: int

    def nodes(self, z: NDArray) -> NDArray:
        """Positions, or displacements, of all nodes, of which those of z come first."""

    def weights(self, z: NDArray) -> NDArray[np.float64]:
        """(e,) w; not finite where cells are flat."""

    def roundings(self, z: NDArray) -> NDArray[np.float64]:
        """(e,) size of the rounding errors of assembled weights, in units of the machine precision."""

    def areas(self, z: NDArray) -> NDArray[np.float64]:
        """Of cells, or of all parts of them, positive for the orientation that prevails."""

    def jacobian(self, z: NDArray, spread: NDArray) -> Jacobian:
        """dw / d(x, y), each row divided by the standard deviation of its weight."""


class _Cotangents:
    """The weights of linear triangles."""

    def __init__(self, piece: Piece):
        self.n, self._piece = piece.n_vertices, piece
        self.weights = partial(edge_weights, piece)
        self.roundings = partial(weight_roundings, piece)
        self.jacobian = partial(WeightJacobian, piece)

    def nodes(self, z: NDArray) -> NDArray:
        return z

    def areas(self, z: NDArray) -> NDArray[np.float64]:
        signed = areas(self._piece, z)
        return signed if signed.sum() >= 0 else -signed


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


def polish(
    drawn: Piece | Model,
    weights: NDArray,
    z: NDArray,
    *,
    scale: float | None = None,
    spread: NDArray | None = None,
    options: PolishOptions | None = None,
) -> PolishedMesh:
    """Improve positions to the level that the entries allow.

    `drawn`: a piece of linear triangles, or weights of another kind; `weights` (e,): a = -A_ij of each edge; `z` (n,):
    start, for instance of :func:`~unassemble.planar.conformal.conformal_map`; `scale`: c, where it is known, otherwise
    it is fitted; `spread` (e,): standard deviations of the errors of a up to a common factor, for instance
    :func:`~unassemble.planar.cotangent.weight_roundings`, of one size by default.

    Raises SolverError if cells are flat at the start, or there are too many.
    """
    options = options or PolishOptions()
    if len(z) > options.most_vertices:
        raise SolverError(f"it has more than {options.most_vertices:,} vertices")
    extent = np.abs(z - z.mean()).max()
    z = (z - z.mean()) / extent
    pins = distant_pair(z)
    spread = np.ones(len(weights)) if spread is None else spread
    model = model_of(drawn)
    problem = Problem(model, weights, spread, scale)
    fit = problem.at(z)
    if not np.isfinite(fit.weights).all():
        raise SolverError("cells are flat")
    equations: NormalEquations | None = None
    system: GaussNewton | None = None
    factorisations, steps, length, converged = 0, 0, np.inf, False
    history: list[tuple[float, float]] = []
    while steps < options.max_steps and not converged:
        jacobian = model.jacobian(fit.z, spread)
        fresh = system is None
        if system is None:
            if equations is not None:
                equations.renew(jacobian)
            else:
                equations = NormalEquations(jacobian, pins, corrected=options.careful)
            system = GaussNewton(jacobian, equations, fit.weights if scale is None else None)
            factorisations += 1
        move = system(jacobian, fit.misfit)
        previous, length = length, float(np.abs(move).max())
        if not length < 1 / ROUNDED:  # of a singular system: nowhere
            break
        slow = length > options.contraction * previous
        if slow and length > options.rounding and not fresh:
            if factorisations == options.max_factorisations:
                break
            system, length = None, np.inf
            continue
        change, share = float(np.linalg.norm(jacobian.forward(move))), 1.0
        if options.careful:
            system, before = None, model.areas(fit.z)
            while share > 1e-4 and (model.areas(fit.z + share * move) < 0.1 * before)[before > 0].any():
                share /= 2  # a cell would lose most of its area
        better = downhill(problem, fit, share * move)
        steps += 1
        _log.debug("polish step %d: length %.1e, misfit %.3e", steps, length, fit.norm)
        # Expect the next step to shrink by the root of the last ratio: a chord iteration's first gain is its best. A
        # step that does not shrink, or does not lower the misfit, is rounding, or the end is not the mesh.
        coming = length * (np.sqrt(min(length / previous, 1.0)) if np.isfinite(previous) else 1.0)
        converged = coming <= options.tolerance or ((slow or better is None) and length <= options.rounding)
        converged = converged or change <= options.settled * fit.noise
        history.append((fit.norm, change))
        # In six steps neither the misfit fell by a thousandth nor the steps became half as large.
        stalled = steps > 6 and fit.norm > 0.999 * history[-7][0] and change > 0.5 * history[-7][1]
        if (better is None or (stalled and options.careful)) and not converged:
            break
        fit = better or fit
    if equations is not None:
        equations.release()
    return PolishedMesh(fit.z * extent, fit.scale, fit.norm, factorisations, converged, length)


def model_of(drawn: Piece | Model) -> Model:
    """That of a piece of linear triangles, or of other cells as it is."""
    return _Cotangents(drawn) if isinstance(drawn, Piece) else drawn


def count_flipped(drawn: Piece | Model, z: NDArray) -> int:
    """Number of triangles, or parts of other cells, that are flat, or turned over relative to the others."""
    return int(np.count_nonzero(~(model_of(drawn).areas(z) > 0)))


def errors_of_one_size(misfit: NDArray, spread: NDArray) -> bool:
    """Whether a misfit is beyond rounding, and normal errors of one size are likelier than those of sizes `spread`.

    Both likelihoods are at their greatest over the common factor.

    `misfit` (e,): a / c - w; `spread` (e,): rounding errors, in units of the machine precision.
    """
    even, uneven = (float(np.linalg.norm(r)) / np.sqrt(len(r)) for r in (misfit, misfit / spread))
    if not (np.isfinite(uneven) and uneven > ROUNDED):
        return False
    return bool(np.log(even) < np.log(uneven) + np.mean(np.log(spread)))
