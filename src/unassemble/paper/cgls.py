"""Conjugate gradients on the normal equations of (7): what BiCG becomes on a symmetric matrix.

References
----------
Paige, Saunders, "LSQR: an algorithm for sparse linear equations and sparse least squares",
ACM TOMS 8, 1982 (algorithm CGLS).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .krylov import KrylovResult, LinearMap


def cgls(matrix: LinearMap, rhs: NDArray, *, tolerance: float, max_steps: int) -> KrylovResult:
    """Least-squares solution of J s = r, from s = 0; two products per step.

    Stops when ``|J^T (r - J s)| <= tolerance |J^T r|``, the relative residual of the system in (7).
    """
    residual = rhs.copy()
    gradient = matrix.adjoint(residual)
    solution, direction = np.zeros_like(gradient), gradient.copy()
    first = size = float(gradient @ gradient)
    steps = 0
    while steps < max_steps and size > tolerance**2 * first:
        image = matrix.forward(direction)
        curvature = float(image @ image)
        if curvature == 0.0:
            break
        length = size / curvature
        solution += length * direction
        residual -= length * image
        gradient = matrix.adjoint(residual)
        previous, size = size, float(gradient @ gradient)
        direction = gradient + (size / previous) * direction
        steps += 1
    return KrylovResult(solution, steps, size <= tolerance**2 * first)
