"""Positions that others would contradict if they were wrong."""

import numpy as np
from numpy.typing import NDArray

from ...errors import GeometryError
from ...linalg import UpperTriangle, nearly_singular
from ...linalg.definite import STEPS
from ...nodes.nodal import NodalMatrix, determined
from ...tolerances import SMALL
from .atlas import PATCH
from .identities import identities
from .placing import Solution, placed


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
    size = np.linalg.svd(left.reshape(m, d**3, -1), compute_uv=False)
    least = np.take_along_axis(size, local.equations[:, None] - 1, axis=1)[:, 0]
    return local.rows[least <= SMALL]
