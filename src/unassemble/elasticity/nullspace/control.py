"""Equations that rest on an assumption, and whether others control them.

An assumption that fails leaves a residual, unless the coordinates that hang on its equations can make up for it. An
equation whose residual they always make up for is uncontrolled: in the words of adjustment computation its redundancy
number is zero, the diagonal entry of I - M M^+ for equations M. With random numbers on the right, the residuals of
least squares vanish in the uncontrolled equations and, but by chance, in no others.

References
----------
Baarda, "A testing procedure for use in geodetic networks", Netherlands Geodetic Commission, 1968.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...linalg import UpperTriangle, nearly_singular
from ...nodes.nodal import NodalMatrix, determined
from .charts import SHIFTS
from .identities import Identities, identities

_NONE = 1e-6  # redundancy that is none: rounding leaves 1e-10, equations that are controlled have 1e-3 and more
_STEPS = 3  # of iterated regularisation, after which fields of singular values far above the shift are gone


def uncontrolled(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    assumed: NDArray[np.bool_],
    points: NDArray[np.float64],
    terms: NDArray[np.float64] | None = None,
) -> NDArray[np.bool_]:
    """(n,) nodes with coordinates that hang on assumed equations which no others control.

    Parameters
    ----------
    nodal : NodalMatrix
    valid, assumed : (n, d, d, d) bool
        Places of the equations, and those among them that rest on the assumption.
    points : (n, d) float64
        NaN where not determined.
    terms : (d, d, d, t) float64, optional
        Unknown boundary terms; see :func:`.identities.identities`.
    """
    graph = nodal.graph
    near = np.asarray(graph @ assumed.reshape(nodal.n, -1).any(axis=1).astype(float) > 0)
    rows = np.flatnonzero(graph @ near.astype(float) > 0)
    around = identities(nodal, valid, rows, terms)
    if not near[around.columns].any():
        return near & determined(points)
    random = np.random.default_rng(0).standard_normal(around.valid.shape)
    left = around.of_values(random[..., None])
    left = left - around.residual(_least_squares(around, near, around.gradient(left)))
    doubted = assumed[around.rows] & (np.abs(left[..., 0]) <= _NONE)
    if not doubted.any():
        return np.zeros(nodal.n, dtype=bool)
    kept = valid.copy()
    kept[around.rows] &= ~doubted
    less = identities(nodal, kept, rows, terms)
    if not near[less.columns].any():
        return near & determined(points)
    field = np.random.default_rng(1).standard_normal((len(less.columns), nodal.dim, 1)) * near[less.columns, None, None]
    field = field - _least_squares(less, near, less.gradient(less.residual(field)))
    loose = near.copy()
    loose[less.columns] &= np.abs(field[..., 0]).max(axis=1) > _NONE
    return loose & determined(points)


def _least_squares(around: Identities, near: NDArray[np.bool_], gradient: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, d, 1) field on the nodes that are near, zero elsewhere, from the gradient of what it has to fit."""
    d, open_ = around.dim, np.repeat(near[around.columns], around.dim)
    normal = sp.csr_array(around.normal_matrix())
    inner = sp.csr_array(normal[open_][:, open_])
    field = np.zeros(len(open_))
    with nearly_singular(UpperTriangle.of(inner), SHIFTS) as solver:
        for _ in range(_STEPS):
            field[open_] += solver.solve(gradient.reshape(-1)[open_] - inner @ field[open_])
    return field.reshape(-1, d, 1)
