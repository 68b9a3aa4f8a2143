"""Least-squares coordinates of a structure's nodes, and how uniquely its equations determine them."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elasticity.nullspace.shape import EXACT, set_aside
from ..errors import GeometryError
from ..linalg import Factorisation, UpperTriangle, nearly_singular
from .equations import Equations

_SHIFTS = (1e-15, 1e-13, 1e-11)  # of the typical diagonal of the normal matrix: the least at which no pivot vanishes
_STEPS = 3
_REFINEMENTS = 30
_SPARE = 6  # fields to look at beyond translations; doubled while all of them are null
_MOST = 200
_PROBES = 3
_CHECKED = 1e-4  # how much of a disturbance of an equation has to be left in its residual for it to be noticed


@dataclass(frozen=True, eq=False)
class Positions:
    """Coordinates of one piece.

    Attributes
    ----------
    points : (n, d) float64
        Centroid at the origin; NaN where loose.
    dimension : int
        Of the null space, loose nodes left out: that of the translations, unless more remains free.
    gap : float
        Singular value of the best field that is no null field.
    residual : float
        Largest residual of an equation, relative to the largest coordinate difference along an edge.
    unchecked : int
        Equations of moments that no other equation contradicts, whatever their right-hand side: a spring between the
        rotation and the ground would move the points unnoticed.
    """

    points: NDArray[np.float64]
    dimension: int
    gap: float
    residual: float
    unchecked: int


def positions(given: Equations, d: int, edges: NDArray[np.int64]) -> Positions:
    """Solve for the coordinates of a connected piece.

    Parameters
    ----------
    given : Equations
        On n d unknowns.
    d : int
    edges : (e, 2) int64
        Coupled nodes.

    Raises
    ------
    GeometryError
        If there are fewer equations than unknowns leave room for, or far more is free than translations.
    """
    operator, right = given.operator, given.right
    n = operator.shape[1] // d
    if n < 2 or operator.shape[0] < (n - 1) * d:
        raise GeometryError(f"{operator.shape[0]} equations are too few for {n} nodes: too much lies next to supports")
    with _normal_solver(operator) as solver:
        fields, values = _least_fields(operator, solver, d)
        x = _least_squares(operator, solver, right[:, None], d)[:, 0]
        unchecked = _unchecked(given, solver, d)
    null, gap = fields[..., values <= EXACT], values[values > EXACT]
    loose = np.zeros(n, dtype=bool)
    if null.shape[2] > d:
        null, loose = set_aside(null, d)
    x = x.reshape(n, d)
    span = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1).max(initial=0)
    residual = float(np.abs(operator @ x.ravel() - right).max()) / (span or 1.0)
    points = np.where(loose[:, None], np.nan, x - x[~loose].mean(axis=0))
    return Positions(points, null.shape[2], float(gap[0]) if len(gap) else float("inf"), residual, unchecked)


def _least_squares(operator: sp.csr_array, solver: Factorisation, right: NDArray, d: int) -> NDArray:
    """(n d, k) centred solutions for right-hand sides (m, k)."""
    x = np.zeros((operator.shape[1], right.shape[1]))
    for _ in range(_REFINEMENTS):
        step = solver.solve(operator.T @ (right - operator @ x))
        step -= np.tile(step.reshape(-1, d, step.shape[1]).mean(axis=0), (len(step) // d, 1))
        x += step
        if np.abs(step).max() <= 1e-15 * np.abs(x).max():
            break
    return x


def _unchecked(given: Equations, solver: Factorisation, d: int) -> int:
    """Equations of moments whose disturbances do not show in any residual.

    Residuals of random right-hand sides are random combinations of the rows of a projector, and a row of it is zero
    if and only if its diagonal entry is: where residuals vanish, the equation can be met whatever it says.
    """
    trusting = np.flatnonzero(given.trusting)
    if not len(trusting):
        return 0
    right = np.zeros((len(given.right), _PROBES))
    right[trusting] = np.random.default_rng(0).standard_normal((len(trusting), _PROBES))
    left = right - given.operator @ _least_squares(given.operator, solver, right, d)
    return int((np.abs(left[trusting]).max(axis=1) < _CHECKED).sum())


def null_fields(operator: sp.csr_array, d: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Fields that an operator on n d unknowns maps to least.

    Returns
    -------
    fields : (n, d, k) float64
        Orthonormal: all null fields, and some more.
    values : (k,) float64
        Their singular values, increasing.

    Raises
    ------
    GeometryError
        If there are far more null fields than translations and enlargements.
    """
    with _normal_solver(operator) as solver:
        return _least_fields(operator, solver, d)


def _normal_solver(operator: sp.csr_array) -> AbstractContextManager[Factorisation]:
    normal = operator.T @ operator
    stored = sp.eye_array(normal.shape[0]) * np.finfo(float).tiny  # coordinates in no equation have a diagonal too
    return nearly_singular(UpperTriangle.of(sp.csr_array(normal + stored)), _SHIFTS)


def _least_fields(operator: sp.csr_array, solver: Factorisation, d: int) -> tuple[NDArray, NDArray]:
    order = operator.shape[1]
    count = min(d + _SPARE, order)
    while True:
        x = np.random.default_rng(0).standard_normal((order, count))
        for _ in range(_STEPS):
            x = np.linalg.qr(solver.solve(x))[0]
        triangle = np.linalg.qr(operator @ x, mode="r")
        _, values, v = scipy.linalg.svd(triangle)
        values = np.concatenate([values, np.zeros(count - len(values))])[::-1]
        if values[-1] > EXACT or count == order:
            return (x @ v[::-1].T).reshape(-1, d, count), values
        if count >= _MOST:
            raise GeometryError("the equations away from supports leave most of the structure free")
        count = min(2 * count, order)
