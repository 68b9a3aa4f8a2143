"""Gauss-Newton far from the solution: a new factorisation for each step, and no triangle turned over on the way.

For starts that noise has bent too far for the chord iteration of :mod:`~unassemble.planar.polish`. Cotangents
have poles where triangles are flat, so a step that turns a triangle over may lower the misfit and still lead away:
steps are cut short before that.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece
from .normal import NormalEquations, WeightJacobian, distant_pair
from .polish import Cotangents, GaussNewton, PolishedMesh, Problem, downhill

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class CautiousOptions:
    """Settings of the iteration."""

    max_steps: int = 40  # each with a factorisation
    most_vertices: int = 200_000  # of a piece for which so many factorisations are worth their time; callers ask
    least_area: float = 0.1  # what a step must leave of the area of every triangle, relative
    settled: float = 1e-3  # as in :class:`~unassemble.planar.polish.PolishOptions`


def cautious_polish(
    piece: Piece,
    weights: NDArray,
    z: NDArray,
    *,
    scale: float | None = None,
    spread: NDArray | None = None,
    options: CautiousOptions | None = None,
) -> PolishedMesh:
    """Maximum-likelihood mesh from a distant start, with a factorisation for each step.

    `weights` (e,); `z` (n,); `spread` (e,): as for the polish.
    """
    options = options or CautiousOptions()
    spread = np.ones(len(weights)) if spread is None else spread
    extent = np.abs(z - z.mean()).max()
    z = (z - z.mean()) / extent
    pins = distant_pair(z)
    problem = Problem(Cotangents(piece), weights, spread, scale)
    fit, steps, length, converged = problem.at(z), 0, np.inf, False
    history: list[tuple[float, float]] = []
    held: NormalEquations | None = None
    while steps < options.max_steps and not converged:
        jacobian = WeightJacobian(piece, fit.z, spread)
        if held is None:
            held = NormalEquations(jacobian, pins)
        else:
            held.renew(jacobian)
        move = GaussNewton(jacobian, held, fit.weights if scale is None else None)(jacobian, fit.misfit)
        steps += 1
        length = float(np.abs(move).max())
        change = float(np.linalg.norm(jacobian.forward(move)))
        converged = change <= options.settled * fit.noise
        history.append((fit.norm, change))
        share = _allowed(piece, fit.z, move, options.least_area)
        better = downhill(problem, fit, share * move)
        _log.debug("cautious step %d: share %.1e, misfit %.3e", steps, share, fit.norm)
        if better is None or (not converged and _stalled(history)):
            break
        fit = better
    if held is not None:
        held.release()
    return PolishedMesh(fit.z * extent, fit.scale, fit.norm, steps, converged, length)


def _stalled(history: list[tuple[float, float]], steps: int = 6) -> bool:
    """Whether in so many steps neither the misfit fell by a thousandth nor the steps became half as large."""
    if len(history) <= steps:
        return False
    (before, long), (now, short) = history[-steps - 1], history[-1]
    return now > 0.999 * before and short > 0.5 * long


def signed_areas(piece: Piece, z: NDArray) -> NDArray[np.float64]:
    """Twice the area of each triangle (m,), positive for the orientation that prevails."""
    a, b, c = z[piece.triangles].T
    areas = (np.conj(b - a) * (c - a)).imag
    return areas if areas.sum() >= 0 else -areas


def count_flipped(piece: Piece, z: NDArray) -> int:
    """Number of triangles that are flat, or turned over relative to the others."""
    return int(np.count_nonzero(~(signed_areas(piece, z) > 0)))


def _allowed(piece: Piece, z: NDArray, move: NDArray, least_area: float) -> float:
    """The first of 1, 1/2, 1/4, ... of a step that leaves triangles that much of their areas."""
    before = signed_areas(piece, z)
    upright = before > 0
    share = 1.0
    while share > 1e-4 and (signed_areas(piece, z + share * move) < least_area * before)[upright].any():
        share /= 2
    return share
