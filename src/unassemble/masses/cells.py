"""What mass matrices look like: weights, density times area at the points of a quadrature, and what tells them.

Areas of quadratic and cubic triangles are told by entries that straight cells share with no other: int grad phi_a .
grad phi_b vanishes for a corner and the side of a quadratic one that faces it, int phi_a phi_b does not. Linear
triangles have no such entries, and quadrilaterals two, fewer than the numbers that they depend on: there areas are
guessed from row sums, s times the integrals of the basis functions.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..conforming.affine import ElementEntries
from ..conforming.sets import pairs_of
from ..elements import KINDS, assembled, exact_rule, mass, volumes
from ..elements.kinds import Kind
from ..errors import SolverError
from ..linalg import solved
from ..matrix import OperatorMatrix

Blocks = Mapping[Kind, NDArray[np.int64]]
Weights = Mapping[Kind, NDArray[np.float64]]  # (m, q) at the points of each cell
TRIANGLE = KINDS["triangle"]


def evenly(kind: Kind, areas: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, q) weights of straight cells with these areas (m,)."""
    weights = exact_rule(kind, more=1)[1]
    return np.outer(areas, weights / weights.sum())


def told_by_entries(matrix: OperatorMatrix, blocks: Blocks) -> Weights | None:
    """Weights of straight triangles in their order; None for other cells."""
    if not all(kind.simplex and kind.degree > 1 for kind in blocks):
        return None
    every = np.sort(np.concatenate([pairs_of(matrix.n, cells).ravel() for cells in blocks.values()]))
    return {
        kind: evenly(kind, ElementEntries(matrix, cells, every, mass=True).masses(kind))
        for kind, cells in blocks.items()
    }


def told_without_stiffness(
    matrix: OperatorMatrix, triangles: NDArray[np.int64], opposite: NDArray[np.int64]
) -> NDArray[np.float64] | None:
    """(m,) areas of linear triangles whose mass matrix this is, by least squares; None where they are not determined.

    `opposite` (m, 3): the edges that face the corners of `triangles`.
    """
    given = np.concatenate([matrix.entries, matrix.diagonal])
    if not given.all():  # those of a mass matrix are all positive
        return None
    own, other = _masses(TRIANGLE, evenly(TRIANGLE, np.ones(1)))[0, 0, :2]
    parts = sp.vstack([other * incidence(opposite, len(matrix.edges)), own * incidence(triangles, matrix.n)])
    weighted = sp.csr_array(sp.diags_array(1 / given) @ parts)  # graded meshes: all to the same number of digits
    unit = sp.diags_array(1 / np.sqrt(weighted.power(2).sum(axis=0)))
    scaled, areas = weighted @ unit, np.zeros(len(triangles))
    try:
        for _ in range(2):  # the second step takes off the error of normal equations
            areas = areas + unit @ solved(sp.csr_array(scaled.T @ scaled), scaled.T @ (1 - weighted @ areas))
    except SolverError:
        return None
    return areas


def incidence(rows: NDArray[np.int64], size: int) -> sp.csr_array:
    """(size, m) sums over the triangles that have a row, (m, 3)."""
    return sp.csr_array((np.ones(rows.size), (rows.ravel(), np.repeat(np.arange(len(rows)), 3))), (size, len(rows)))


def guessed_from_sums(sums: NDArray[np.float64], blocks: Blocks) -> Weights:
    """Weights that share each row sum (n,) evenly among the cells of its row."""
    count = sum(np.bincount(cells.ravel(), minlength=len(sums)) for cells in blocks.values())
    return {kind: evenly(kind, (sums / np.maximum(count, 1))[cells].sum(axis=1)) for kind, cells in blocks.items()}


def weights_at(points: NDArray[np.float64], blocks: Blocks) -> Weights:
    """Areas, or volumes, at the points of each cell of a mesh (n, d)."""
    return {kind: volumes(points, cells, kind, exact_rule(kind, more=1)) for kind, cells in blocks.items()}


def _masses(kind: Kind, weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, k, k) mass matrices of cells of these weights."""
    return mass(kind, exact_rule(kind, more=1)[0], weights)


def mass_matrix(n: int, blocks: Blocks, weights: Weights) -> sp.csr_array:
    """(n, n) mass matrix of cells of these weights."""
    total = sp.csr_array((n, n))
    for kind, cells in blocks.items():
        total = total + assembled(_masses(kind, weights[kind]), cells, n)
    return total


def less(matrix: OperatorMatrix, blocks: Blocks, weights: Weights) -> OperatorMatrix:
    """A matrix without the mass matrix that cells of these weights have; what vanished is left alone."""
    M, (i, j) = mass_matrix(matrix.n, blocks, weights), matrix.edges.T
    return replace(matrix, entries=matrix.entries - M[i, j], diagonal=matrix.diagonal - M.diagonal())
