"""Biconjugate gradients on a square Jacobian (paper, section 3.3, reference [9] algorithm 7.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .krylov import KrylovResult, LinearMap


def bicg(matrix: LinearMap, rhs: NDArray, *, tolerance: float, max_steps: int) -> KrylovResult:
    """Solution of J s = r with J square, from s = 0; one product with J and one with J^T per step.

    (The paper says that the transpose is not needed here. BiCG needs it; only its successors do not.)
    Stops when ``|r - J s| <= tolerance |r|``, and at a breakdown, which is reported as not converged.
    The best iterate is returned: the residuals of BiCG go up and down by orders of magnitude.
    """
    solution = np.zeros(matrix.shape[1])
    residual, shadow = rhs.copy(), rhs.copy()
    direction, shadow_direction = residual.copy(), shadow.copy()
    target = tolerance * float(np.linalg.norm(rhs))
    size = least = float(np.linalg.norm(rhs))
    rho, best, steps = float(shadow @ residual), solution.copy(), 0
    while steps < max_steps and size > target:
        image = matrix.forward(direction)
        curvature = float(shadow_direction @ image)
        if not np.isfinite(curvature) or abs(curvature) < 1e-300 or abs(rho) < 1e-300:
            break
        length = rho / curvature
        solution += length * direction
        residual -= length * image
        shadow -= length * matrix.adjoint(shadow_direction)
        size = float(np.linalg.norm(residual))
        steps += 1
        if size < least:
            least, best = size, solution.copy()
        previous, rho = rho, float(shadow @ residual)
        direction = residual + (rho / previous) * direction
        shadow_direction = shadow + (rho / previous) * shadow_direction
    return KrylovResult(best, steps, least <= target)
