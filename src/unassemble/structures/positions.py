"""Fields that equations leave free, and least-squares solutions beside them."""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import REFINEMENTS
from ..errors import GeometryError
from ..linalg import Factorisation, UpperTriangle, nearly_singular
from ..linalg.definite import STEPS
from ..nodes.shape import MOST_FIELDS
from ..tolerances import LAST_DIGITS, SINGULAR

_PROBES = 3


def least_squares(
    operator: sp.csr_array, right: NDArray[np.float64], d: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Solve equations for n nodes with d coordinates each, and see what they leave free and which of them are spare.

    Parameters
    ----------
    operator : (m, n d) sparse
    right : (m,) float64
    d : int

    Returns
    -------
    solution : (n d,) float64
        Without what is free.
    residuals : (m, k) float64
        Of the right-hand side, first, and of random ones.
    fields : (n, d, k) float64
        Orthonormal: all null fields, and some more.
    values : (k,) float64
        Their singular values, increasing.

    Raises
    ------
    GeometryError
        If far more is free than translations and enlargements.
    """
    random = np.random.default_rng(0).standard_normal((len(right), _PROBES))
    sides = np.column_stack([right, random])
    normal = operator.T @ operator
    stored = sp.eye_array(normal.shape[0]) * np.finfo(float).tiny  # coordinates in no equation have a diagonal too
    with nearly_singular(UpperTriangle.of(sp.csr_array(normal + stored))) as solver:
        fields, values = _least_fields(operator, solver, d)
        free = fields[..., values <= SINGULAR].reshape(operator.shape[1], -1)
        x = np.zeros((operator.shape[1], sides.shape[1]))
        for _ in range(REFINEMENTS):
            step = solver.solve(operator.T @ (sides - operator @ x))
            step -= free @ (free.T @ step)
            x += step
            if np.abs(step[:, 0]).max() <= LAST_DIGITS * np.abs(x[:, 0]).max():
                break
    return x[:, 0], sides - operator @ x, fields, values


def _least_fields(operator: sp.csr_array, solver: Factorisation, d: int) -> tuple[NDArray, NDArray]:
    """Fields (n, d, k) that the operator maps to least, and their singular values."""
    order = operator.shape[1]
    count = min(4 * d, order)
    while True:
        x = np.random.default_rng(0).standard_normal((order, count))
        for _ in range(STEPS):
            x = np.linalg.qr(solver.solve(x))[0]
        triangle = np.linalg.qr(operator @ x, mode="r")
        _, values, v = scipy.linalg.svd(triangle)
        values = np.concatenate([values, np.zeros(count - len(values))])[::-1]
        if values[-1] > SINGULAR or count == order:
            return (x @ v[::-1].T).reshape(-1, d, count), values
        if count >= MOST_FIELDS:
            raise GeometryError("the equations away from supports leave most of the structure free")
        count = min(2 * count, order)
