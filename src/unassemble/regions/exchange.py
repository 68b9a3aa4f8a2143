"""Triangles that belong to the region beside them: what the misfit of a fit shows, geometry taken out.

Changing triangle t to a region with another factor adds a column b_t to the linearised problem, with entries at its
three sides. Displacements and factors take up what they can: with the projection P from their columns, the changes are
those numbers between 0 and 1 that make |P (r - sum_t a_t b_t)| least, r the misfit; about 0 where nothing changes, and
about 1 where something does. All that is wrong shows at once, as far as it is small.
"""

from collections.abc import Iterator
from functools import cache

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from ..boundaries.fit import System, WholeEntries
from ..boundaries.shape import ShapePrior
from ..errors import SolverError
from ..planar.cotangent import cotangent
from .guess import corners_of


def exchanges(problem: WholeEntries, z: NDArray[np.complex128], scale: NDArray) -> Iterator[NDArray[np.int64]]:
    """Regions (m,) of which some triangles are another's, the likeliest first.

    At positions z (n,) and factors (k,) all entries are fitted, as far as they go.
    """
    piece, region, misfit = problem.piece, problem.region, problem.misfits(z, scale)
    triangle, other = _beside(problem)
    corner = z[piece.triangles[triangle]]
    half = cotangent(np.roll(corner, -1, axis=1) - corner, np.roll(corner, 1, axis=1) - corner) / 2
    sides = piece.opposite[triangle]
    column = half * (scale[other] - scale[region[triangle]])[:, None] / problem.unit(scale)[sides]
    score = np.nan_to_num((column * misfit[sides]).sum(axis=1) / np.sqrt((column**2).sum(axis=1)), nan=-np.inf)

    @cache
    def shares(only: bool) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        order = np.argsort(-score)[:300]
        order = order[score[order] > 0] if only else order
        return order, _shares(problem, z, scale, misfit, column[order], sides[order])

    # above which number triangles change, and whether only those are candidates that entries speak for by themselves
    for least, only in ((0.5, True), (0.5, False), (0.25, True), (0.9, True)):
        order, share = shares(only)
        taken = order[share > least]
        if len(taken):
            new = region.copy()
            new[triangle[taken]] = other[taken]
            yield new
    # next to the largest misfits one alone: on the boundary positions take up nearly all of a change to first order
    for one in np.argsort(-np.abs(misfit[sides]).max(axis=1))[:8].tolist():
        new = region.copy()
        new[triangle[one]] = other[one]
        yield new


def _beside(problem: WholeEntries) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles, and regions other than theirs that they share a vertex with."""
    piece, region, m = problem.piece, problem.region, len(problem.piece.triangles)
    corners = corners_of(piece)
    kinds = sp.csr_array((np.ones(m), region, np.arange(m + 1)), shape=(m, int(region.max()) + 1))
    triangle, other = sp.coo_array(corners @ (corners.T @ kinds)).coords
    change = other != region[triangle]
    return triangle[change], other[change]


def _shares(
    problem: WholeEntries, z: NDArray, scale: NDArray, misfit: NDArray, column: NDArray, sides: NDArray
) -> NDArray[np.float64]:
    """(k,) numbers between 0 and 1 of columns with entries (k, 3) at sides (k, 3)."""
    count = len(column)
    if not count:
        return np.zeros(0)
    whole = np.ones(len(misfit), dtype=bool)
    added = sp.csr_array((column.ravel(), sides.ravel(), np.arange(0, 3 * count + 1, 3)), shape=(count, len(misfit)))
    system = System(problem, z, scale, whole, ShapePrior.of(problem.piece, ~whole), 0.0, misfit, np.zeros(0))
    matrix = system.damped(1e-10)
    try:
        factor = problem.analysed(matrix)
        factor.factorise(matrix)
    except SolverError:
        problem.release()
        return np.zeros(count)
    pulled = sp.csr_array((system.jacobian_transposed @ added.T).T)
    response = factor.solve(system.slope)
    along = added @ problem.slopes(z, scale) - pulled @ response
    gram = (added @ added.T).toarray()
    for first in range(0, count, 32):
        some = slice(first, first + 32)
        gram[:, some] -= pulled @ factor.solve(np.ascontiguousarray(pulled[some].T.toarray()))
    gram -= along @ np.linalg.lstsq(system.size - system.slope.T @ response, along.T, rcond=None)[0]
    if not np.isfinite(gram).all():
        return np.zeros(count)
    value, vector = np.linalg.eigh((gram + gram.T) / 2)
    root = np.sqrt(np.maximum(value, 1e-8 * value.max()))
    return np.asarray(lsq_linear((vector * root).T, (vector / root).T @ (added @ misfit), bounds=(0, 1)).x)
