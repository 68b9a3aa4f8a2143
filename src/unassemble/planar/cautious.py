"""Gauss-Newton far from the solution: a new factorisation for each step, and no triangle turned over on the way.

For starts that noise has bent too far for the chord iteration of :mod:`~unassemble.planar.polish`. Cotangents
have poles where triangles are flat, so a step that turns a triangle over may lower the misfit and still lead away:
steps are cut short before that.
"""

from __future__ import annotations

import logging

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece
from .normal import NormalEquations, WeightJacobian, distant_pair
from .polish import Cotangents, GaussNewton, PolishedMesh, PolishOptions, Problem, downhill

_log = logging.getLogger(__name__)


MOST_VERTICES = 200_000
"""Of a piece for which so many factorisations are worth their time."""


def cautious_polish(
    piece: Piece,
    weights: NDArray,
    z: NDArray,
    *,
    scale: float | None = None,
    spread: NDArray | None = None,
) -> PolishedMesh:
    """Maximum-likelihood mesh from a distant start, with a factorisation for each step.

    `weights` (e,); `z` (n,); `spread` (e,): as for the polish.
    """
    spread = np.ones(len(weights)) if spread is None else spread
    extent = np.abs(z - z.mean()).max()
    z = (z - z.mean()) / extent
    pins = distant_pair(z)
    problem = Problem(Cotangents(piece), weights, spread, scale)
    fit, steps, length, converged = problem.at(z), 0, np.inf, False
    history: list[tuple[float, float]] = []
    held: NormalEquations | None = None
    while steps < 40 and not converged:
        jacobian = WeightJacobian(piece, fit.z, spread)
        if held is None:
            held = NormalEquations(jacobian, pins)
        else:
            held.renew(jacobian)
        move = GaussNewton(jacobian, held, fit.weights if scale is None else None)(jacobian, fit.misfit)
        steps += 1
        length = float(np.abs(move).max())
        change = float(np.linalg.norm(jacobian.forward(move)))
        converged = change <= PolishOptions.settled * fit.noise
        history.append((fit.norm, change))
        before, share = signed_areas(piece, fit.z), 1.0
        while share > 1e-4 and (signed_areas(piece, fit.z + share * move) < 0.1 * before)[before > 0].any():
            share /= 2  # a triangle would lose most of its area
        better = downhill(problem, fit, share * move)
        _log.debug("cautious step %d: share %.1e, misfit %.3e", steps, share, fit.norm)
        # In six steps neither the misfit fell by a thousandth nor the steps became half as large.
        stalled = steps > 6 and fit.norm > 0.999 * history[-7][0] and change > 0.5 * history[-7][1]
        if better is None or (stalled and not converged):
            break
        fit = better
    if held is not None:
        held.release()
    return PolishedMesh(fit.z * extent, fit.scale, fit.norm, steps, converged, length)


def signed_areas(piece: Piece, z: NDArray) -> NDArray[np.float64]:
    """Twice the area of each triangle (m,), positive for the orientation that prevails."""
    a, b, c = z[piece.triangles].T
    areas = (np.conj(b - a) * (c - a)).imag
    return areas if areas.sum() >= 0 else -areas


def count_flipped(piece: Piece, z: NDArray) -> int:
    """Number of triangles that are flat, or turned over relative to the others."""
    return int(np.count_nonzero(~(signed_areas(piece, z) > 0)))
