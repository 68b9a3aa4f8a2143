"""More nodes placed from those whose places are known: a least-squares problem for these alone.

Rows next to supports have few equations, and leave many fields of the nodes next to them free as long as not all that
is known of these is used. So the rest of the body goes first; what it determines does not change any more.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...errors import GeometryError
from ...linalg import UpperTriangle, nearly_singular, typical_diagonal
from ..nodal import NodalMatrix, determined
from .charts import SHIFTS, short_of_equations
from .identities import Identities, identities
from .shape import EXACT

_STEPS = 30  # at most: each divides what is wrong by its eigenvalue over the shift
_GAIN = 0.9  # of a residual: what more is left after a step is rounding
_PROBES = 8
_AMPLE = 2  # nodes next to false planes that fit had up to 1.7, in the plane; in space true ones have 2.3 to 9
_SOFT = 5e-6  # singular values below which nodes count as loose, whatever fits
_WRONG = 1e-9  # of the norm of all coordinates: what those of one node may be wrong by


def well_supplied(nodal: NodalMatrix, valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n, d, d) the valid pairs without those of rows that cannot place what they touch, where some rows lack pairs.

    Each node takes d equations, which the rows that touch it share. A row with less than its share leaves nodes free to
    move; without it, others may be short of equations, too. In the plane whole rows are kept.
    """
    whole = np.asarray(valid.all(axis=(1, 2)))
    rows = np.flatnonzero(valid.any(axis=(1, 2)))
    if whole[rows].all():  # nothing to gain
        return valid
    while len(rows):
        local = identities(nodal, valid, rows)
        short = short_of_equations(local)
        if nodal.dim == 2:  # of quadratic elements all rows would turn out short, one after the other
            short &= ~whole[local.rows]
        rows = local.rows[~short]
        if not short.any():
            break
    kept = np.zeros(nodal.n, dtype=bool)
    kept[rows] = True
    return valid & kept[:, None, None]


def extended(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    points: NDArray[np.float64],
    terms: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.float64], float] | None:
    """Points of all nodes that the valid rows place, if those of some are known; and the norm of what does not fit.

    Parameters
    ----------
    nodal : NodalMatrix
    valid : (n, d, d) or (n, d, d, d) bool
    points : (n, d) float64
        Of one piece; NaN where not known.
    terms : (d, d, d, t) float64, optional
        Unknown boundary terms; see :func:`.identities.identities`.

    Returns
    -------
    (n, d) float64, float
        The residual is relative to the norm of the coordinates. None where the rows do not fit exactly.
    """
    known = determined(points)
    local = identities(nodal, valid, np.flatnonzero(nodal.graph @ (~known).astype(float) > 0), terms)
    free = ~known[local.columns]
    if not len(local.rows) or not free.any():
        return points, 0.0
    middle = points[known].mean(axis=0)
    x = np.where(free[:, None], 0.0, points[local.columns] - middle)
    size = float(np.linalg.norm(points[known] - middle))
    try:
        x, residual, loose = _solved(local, x, free, size)
    except GeometryError:
        return None
    if residual > EXACT:
        return None
    more = points.copy()
    more[local.columns[free & ~loose]] = x[free & ~loose] + middle
    return more, residual


def overdetermined(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    points: NDArray[np.float64],
    terms: NDArray[np.float64] | None = None,
) -> NDArray[np.bool_]:
    """(n,) nodes without points that have twice the equations they take; each row's are shared by all such it touches.

    Wrong equations do not fit there, while coordinates fit to as many equations as they are, whatever these say.
    """
    known = determined(points)
    found = np.zeros(nodal.n, dtype=bool)
    local = identities(nodal, valid, np.flatnonzero(nodal.graph @ (~known).astype(float) > 0), terms)
    if len(local.rows):
        free = ~known[local.columns][local.indices]
        count = np.maximum(np.add.reduceat(free.astype(float), local.indptr[:-1]), 1)
        share = np.repeat(local.equations / count, np.diff(local.indptr)) * free
        found[local.columns] = np.bincount(local.indices, share, len(local.columns)) >= _AMPLE * local.dim
    return found


def _solved(
    local: Identities, x: NDArray[np.float64], free: NDArray[np.bool_], size: float
) -> tuple[NDArray[np.float64], float, NDArray[np.bool_]]:
    """Coordinates (n, d) with those of free nodes fitted, what does not fit, and which nodes are left loose.

    Those are loose that a field moves whose singular value is so small that what does not fit may have moved them, too.
    Of a random field each step leaves the shift over the shift and the square of the singular value.
    """
    n, d = x.shape
    unknown = np.flatnonzero(np.repeat(free, d))
    normal = local.normal_matrix().tocsr()
    unit = typical_diagonal(normal.diagonal())  # what is next to nothing beside it, of free nodes alone, is rounding
    normal = normal[unknown][:, unknown]
    with nearly_singular(UpperTriangle.of(normal), SHIFTS, unit) as solver:

        def answer(residual: NDArray) -> NDArray[np.float64]:
            gradient = local.gradient(residual).reshape(n * d, -1)
            change = np.zeros_like(gradient)
            change[unknown] = solver.solve(gradient[unknown])
            return change.reshape(n, d, -1)

        residual = local.residual(x[:, :, None])
        for _ in range(_STEPS):
            better = x - answer(residual)[..., 0]
            left = local.residual(better[:, :, None])
            if np.linalg.norm(left) > _GAIN * np.linalg.norm(residual):
                break
            x, residual = better, left
        probe = np.random.default_rng(0).standard_normal((n, d, _PROBES)) * free[:, None, None]
        for _ in range(2):
            probe = probe - answer(local.residual(probe))
    misfit = float(np.linalg.norm(residual)) / size
    shift = SHIFTS[0] * unit
    left_over = (shift / (shift + max(_SOFT, misfit / _WRONG) ** 2)) ** 2
    return x, misfit, np.abs(probe).max(axis=(1, 2)) > left_over
