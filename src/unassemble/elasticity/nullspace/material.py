"""The ratio of the Lame coefficients, read off the boundary terms p and q, and Poisson's ratio."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...nodes.nodal import NodalMatrix, determined
from ...tolerances import ALIKE, SMALL
from .identities import identities


def poisson_ratio(lame_ratio: float) -> float:
    """Poisson's ratio, in plane strain where the body is plane, of lambda / mu."""
    return lame_ratio / (2 * (1 + lame_ratio))


def lame_ratio(nodal: NodalMatrix, valid: NDArray[np.bool_], points: NDArray[np.float64]) -> float | None:
    """The number lambda / mu of the body; None where it varies or does not show.

    p = int lambda grad phi_i and q = int mu grad phi_i are in the ratio lambda : mu at every node. They vanish at nodes
    around which the material is homogeneous, so that nodes on free surfaces and material interfaces count.
    """
    known = determined(points)
    local = identities(nodal, valid, np.arange(nodal.n))
    if not len(local.rows):
        return None
    x = np.where(known[:, None], points, 0.0)[local.columns]
    p, q = local.boundary_values(x)
    unknown = np.zeros(nodal.n)
    unknown[nodal.node[~known[nodal.indices]]] = 1
    good = np.isfinite(p).all(axis=1) & (unknown[local.rows] == 0)
    p, q = p[good], q[good]
    strength = np.linalg.norm(q, axis=1)
    if not len(q) or strength.max() < 1e-8:
        return None
    p, q = p[strength > SMALL * strength.max()], q[strength > SMALL * strength.max()]
    ratio = float((p * q).sum() / (q * q).sum())
    misfit = np.linalg.norm(p - ratio * q, axis=1) / np.linalg.norm(q, axis=1)
    if np.max(misfit) > ALIKE * (1 + abs(ratio)):
        return None
    return ratio
