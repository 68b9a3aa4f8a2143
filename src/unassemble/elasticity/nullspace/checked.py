"""Positions that others would contradict if they were wrong."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...errors import GeometryError
from ...linalg import UpperTriangle, nearly_singular
from ...linalg.definite import STEPS
from ...nodes.nodal import NodalMatrix, determined
from ...tolerances import ALIKE, SMALL
from .atlas import PATCH
from .identities import Identities, identities
from .placing import Solution, placed

_DENSE = 2000  # coordinates of nodes beside cells that one dense decomposition checks


def checked(nodal: NodalMatrix, solution: Solution) -> NDArray[np.bool_]:
    """(n,) nodes of the largest piece that identities determine each of which others would contradict if it were wrong.

    A disturbance of the entries of one node adds some e to the right-hand side of its identities. It shows unless the
    coordinates can follow it: unless P e = 0, where P projects on what no coordinates reach. Those e that show are
    spanned by what is left of random right-hand sides g there, P g. Of bodies with more nodes than a chart all are
    taken for such: their normal matrix is never factorised as a whole.
    """
    known = determined(solution.firm_points)
    while nodal.n <= PATCH[nodal.dim] and len(lone := _unnoticed(nodal, solution)):
        valid = solution.valid.copy()
        valid[lone] = False
        try:
            solution = placed(nodal, valid)
        except GeometryError:
            return np.zeros_like(known)
        if not solution.unique:
            return np.zeros_like(known)
        largest = np.bincount(solution.component[solution.component >= 0]).argmax()
        known &= determined(solution.points) & (solution.component == largest)
    return known


def checked_beside(nodal: NodalMatrix, solution: Solution, free: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) nodes among some, `free` (n,), that identities determine and others check, where all others are sure.

    As :func:`checked`, but with the nodes of cells that re-assemble held fast.
    """
    known = determined(solution.firm_points)
    if np.count_nonzero(free) * nodal.dim > _DENSE:
        return checked(nodal, solution)
    valid, d = solution.valid.copy(), nodal.dim
    blind = nodal.graph @ (~known).astype(float) > 0
    while True:
        local = identities(nodal, valid, np.flatnonzero(~blind))
        own = np.flatnonzero(np.repeat(free[local.columns], d))
        determines = np.zeros_like(known)
        if not len(own):
            return determines
        value, vector = np.linalg.eigh(sp.csr_array(local.normal_matrix())[own][:, own].toarray())
        moving = value <= ALIKE**2 * max(value[-1], 1.0)
        shift = np.zeros((len(local.columns) * d, int(moving.sum())))
        shift[own] = vector[:, moving]
        loose = np.abs(shift).reshape(len(local.columns), -1).max(axis=1, initial=0.0) > ALIKE
        determines[local.columns[~loose]] = True
        vector, value = vector[:, ~moving], value[~moving]

        many = d**3 + 5
        g = np.random.default_rng(0).standard_normal((len(local.rows), d, d, d, many)) * local.valid[..., None]
        left = local.outside_terms(g)
        gradient = local.gradient(left).reshape(len(shift), -1)[own]
        x = np.zeros((len(shift), many))
        x[own] = vector @ ((vector.T @ gradient) / value[:, None])
        left = left - local.residual(x.reshape(len(local.columns), d, -1))
        lone = _small(local, left)
        if not len(lone):
            return np.asarray(free & known & determines)
        valid[lone] = False


def _small(local: Identities, left: NDArray[np.float64]) -> NDArray[np.int64]:
    """Nodes of whose identities some disturbance leaves next to nothing, (m, d, d, d, k)."""
    size = np.linalg.svd(left.reshape(len(local.rows), local.dim**3, -1), compute_uv=False)
    least = np.take_along_axis(size, local.equations[:, None] - 1, axis=1)[:, 0]
    return local.rows[least <= SMALL]


def _unnoticed(nodal: NodalMatrix, solution: Solution) -> NDArray[np.int64]:
    """Nodes with identities that a disturbance might change without being noticed."""
    d = nodal.dim
    blind = nodal.graph @ (~determined(solution.firm_points)).astype(float) > 0
    local = identities(nodal, solution.valid, np.flatnonzero(~blind))
    n, m = len(local.columns), len(local.rows)
    if not m:
        return local.rows
    many = d**3 + 5  # more than a node has identities, so that they span what there is by a safe margin
    g = np.random.default_rng(0).standard_normal((m, d, d, d, many)) * local.valid[..., None]
    left = local.outside_terms(g)
    with nearly_singular(UpperTriangle.of(local.normal_matrix())) as solver:
        for _ in range(STEPS):
            x = solver.solve(local.gradient(left).reshape(n * d, -1))
            left = left - local.residual(x.reshape(n, d, -1))
    return _small(local, left)
