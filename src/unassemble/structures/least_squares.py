"""Equations for coordinates solved by least squares: what they leave free, and which of them are spare."""

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import REFINEMENTS
from ..errors import GeometryError
from ..linalg import Factorisation, UpperTriangle, nearly_singular
from ..linalg.definite import STEPS
from ..nodes.shape import MOST_FIELDS, in_gauge, shape
from ..recovery import Evidence
from ..tolerances import LAST_DIGITS, SINGULAR
from .connected import Piece

_PROBES = 3


def up_to_size(piece: Piece, d: int) -> tuple[NDArray[np.float64], Evidence, NDArray[np.float64]]:
    """Points of a piece whose equations leave the size free, evidence, and residuals (m, k) of random right-hand sides.

    GeometryError if more is free than translations and size.
    """
    n, m = len(piece.nodes), len(piece.rows)
    _, residuals, fields, values, gap = least_squares(piece.operator, np.zeros(m), d)
    one = shape(fields, values, np.zeros(n, dtype=bool))
    links = sp.csr_array((np.ones(len(piece.edges)), piece.edges.T), shape=(n, n))
    return in_gauge(one.points, links), Evidence(one.dimension, float(values[d]), gap, m), residuals[:, 1:]


def least_squares(
    operator: sp.csr_array, right: NDArray[np.float64], d: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float]:
    """Solve equations for n nodes with d coordinates each, and see what they leave free and which of them are spare.

    The solution (n d,) for the right-hand side, the first if there are several, without what is free; residuals (m, k)
    of all and of random ones; orthonormal fields (n, d, k), all null fields and some more, and their singular values,
    increasing; and the least of these that is none of a null field. GeometryError if far more is free than translations
    and enlargements.
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
    gap = float(values[values > SINGULAR].min(initial=np.inf))
    return x[:, 0], sides - operator @ x, fields, values, gap


def _least_fields(operator: sp.csr_array, solver: Factorisation, d: int) -> tuple[NDArray, NDArray]:
    """Fields (n, d, k) that the operator maps to least, and their singular values."""
    order = operator.shape[1]
    count = min(4 * d, order)
    while True:
        x = np.random.default_rng(0).standard_normal((order, count))
        for _ in range(STEPS):
            x = np.linalg.qr(solver.solve(x))[0]
        _, values, v = scipy.linalg.svd(np.linalg.qr(operator @ x, mode="r"))
        values = np.concatenate([values, np.zeros(count - len(values))])[::-1]
        if values[-1] > SINGULAR or count == order:
            return (x @ v[::-1].T).reshape(-1, d, count), values
        if count >= MOST_FIELDS:
            raise GeometryError("the equations away from supports leave most of the structure free")
        count = min(2 * count, order)
