"""Slender bodies: one more step for coordinates, whose residual is that of the whole body.

A body n times as long as thick has fields that satisfy the identities up to 1 / n^2: it bends. What charts leave in
these is taken off by one least-squares problem for the whole body. Its residual is summed from differences along edges,
so that rounding is relative to these and not to the length of the body; normal equations do, as long as steps shrink.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from ...budget import REFINEMENTS
from ...errors import SolverError
from ...linalg.normal import NormalEquations
from ...nodes.nodal import NodalMatrix, determined, linked
from ...tolerances import SMALL
from .identities import Identities, boundary_basis, identities

_WORK = 3e6  # nodes times the square of those across, up to which one factorisation costs a few seconds


def affordable(points: NDArray[np.float64]) -> bool:
    """Whether a piece (n, d) whose mean edge is 1 is small, or long and thin."""
    across = len(points) / max(float(np.ptp(points, axis=0).max()), 1.0)
    return len(points) * across**2 <= _WORK


def unbent(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    points: NDArray[np.float64],
    gap: float,
    terms: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.float64], float]:
    """Coordinates nearer to the null vector of the valid identities, of which there is one but for translations.

    And the norm of their residual, rounding of the entries included, over that of the centred coordinates; infinite
    where the points are left as they are, since rows that touch no loose node do not hold the piece together.

    Parameters
    ----------
    nodal : NodalMatrix
    valid : (n, d, d) or (n, d, d, d) bool
    points : (n, d) float64
        Of one piece, NaN elsewhere; of about unit size from node to node.
    gap : float
        Singular value of the next field, all rows counted.
    terms : (d, d, d, t) float64, optional
        Unknown boundary terms; see :func:`.identities.identities`.
    """
    body = determined(points)
    apart = np.bincount(nodal.node, linked(nodal, valid) & ~body[nodal.indices], nodal.n) > 0
    local = identities(nodal, valid, np.flatnonzero(body & ~apart), terms)
    if not len(local.columns):
        return points, float("inf")
    equations = _equations(local)
    x = points[local.columns]
    free = np.ones(x.shape, dtype=bool)
    far = np.abs(x - x[0]).argmax()
    free[0] = False
    free.flat[far] = False
    columns = sp.csr_array(equations[:, np.flatnonzero(free.ravel())])
    try:
        system = NormalEquations(columns)
    except SolverError:
        return points, float("inf")
    try:
        # Holding the first node, not the centroid, makes a piece softer by the root of its number of nodes, and random
        # numbers add some tens; a field that is free adds a million.
        if SMALL * gap * _softness(system, equations.shape[0]) > np.sqrt(len(x)):
            return points, float("inf")
        x = _stepped(system, equations, x, free)
    except SolverError:
        return points, float("inf")
    finally:
        system.release()
    better = points.copy()
    better[local.columns] = x
    residual = np.linalg.norm(_residual(equations, x)) + np.finfo(float).eps * np.sqrt(equations.shape[0])
    return better, float(residual / np.linalg.norm(x - x.mean(axis=0)))


def _stepped(
    system: NormalEquations, equations: sp.csr_array, x: NDArray[np.float64], free: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Coordinates (n, d) after steps as long as they shrink, down to rounding."""
    x, before = x.copy(), np.inf
    for _ in range(REFINEMENTS):
        step = system.solve(_residual(equations, x))
        x[free] -= step
        size = float(np.linalg.norm(step))
        if not 2 * size <= before:
            break
        before = size
    return x


def _softness(system: NormalEquations, equations: int) -> float:
    """About one over the least singular value: the norm of what solves for signs at random."""
    signs = np.random.default_rng(0).choice([-1.0, 1.0], equations)
    return float(np.linalg.norm(system.solve(signs)))


def _equations(local: Identities) -> sp.csr_array:
    """(r, n d) what sticks out of the boundary terms, in coordinates: some equations for each node."""
    d, m = local.dim, len(local.rows)
    code = local.valid.reshape(m, -1) @ (1 << np.arange(d**3))
    row = np.repeat(np.arange(m), np.diff(local.indptr))
    blocks = np.zeros((len(local.indices), d**3, d))
    for kind in np.unique(code):
        one = local.valid[np.argmax(code == kind)]
        basis = boundary_basis(one, local.terms).reshape(d**3, -1)
        seen = np.eye(d**3)[:, one.ravel()]
        outside = seen @ scipy.linalg.null_space((seen.T @ basis).T) if basis.shape[1] else seen
        here = code[row] == kind
        weights = outside.reshape(d, d, d, -1)
        blocks[here, : outside.shape[1]] = np.einsum("ecb,cbas->esa", local.data[here], weights, optimize=True)
    shape = (m * d**3, len(local.columns) * d)
    found = sp.csr_array(sp.bsr_array((blocks, local.indices, local.indptr), shape=shape))
    found.eliminate_zeros()
    return sp.csr_array(found[np.diff(found.indptr) > 0])


def _residual(equations: sp.csr_array, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """What the equations, whose coefficients add up to zero in each direction, leave of coordinates (n, d)."""
    d = x.shape[1]
    node, direction = np.divmod(equations.indices, d)
    centre = np.repeat(node[equations.indptr[:-1]], np.diff(equations.indptr))
    steps = x[node, direction] - x[centre, direction]
    return np.add.reduceat(equations.data * steps, equations.indptr[:-1])
