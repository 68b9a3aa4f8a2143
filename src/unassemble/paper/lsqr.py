"""LSQR: the same iterates as CGLS by Golub-Kahan bidiagonalisation, steadier when J is nearly singular.

References
----------
Paige, Saunders, "LSQR: an algorithm for sparse linear equations and sparse least squares", ACM TOMS 8, 1982.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .krylov import KrylovResult, LinearMap


def lsqr(matrix: LinearMap, rhs: NDArray, *, tolerance: float, max_steps: int) -> KrylovResult:
    """Least-squares solution of J s = r, from s = 0; two products per step; stops as :func:`cgls` does."""
    beta = float(np.linalg.norm(rhs))
    if beta == 0.0:
        return KrylovResult(np.zeros(matrix.shape[1]), 0, True)
    u = rhs / beta
    v = matrix.adjoint(u)
    alpha = float(np.linalg.norm(v))
    if alpha == 0.0:
        return KrylovResult(np.zeros(matrix.shape[1]), 0, True)
    v /= alpha
    direction, solution = v.copy(), np.zeros_like(v)
    phi_bar, rho_bar, first = beta, alpha, alpha * beta
    steps, gradient = 0, first
    while steps < max_steps and gradient > tolerance * first:
        u = matrix.forward(v) - alpha * u
        beta = float(np.linalg.norm(u))
        u = u / beta if beta else u
        v = matrix.adjoint(u) - beta * v
        alpha = float(np.linalg.norm(v))
        v = v / alpha if alpha else v
        rho = float(np.hypot(rho_bar, beta))
        cosine, sine = rho_bar / rho, beta / rho
        theta, rho_bar = sine * alpha, -cosine * alpha
        phi, phi_bar = cosine * phi_bar, sine * phi_bar
        solution += (phi / rho) * direction
        direction = v - (theta / rho) * direction
        gradient = phi_bar * alpha * abs(cosine)
        steps += 1
    return KrylovResult(solution, steps, gradient <= tolerance * first)
