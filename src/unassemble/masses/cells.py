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
from ..elements import assembled, exact_rule, mass, volumes
from ..elements.kinds import Kind
from ..errors import SolverError
from ..linalg import solved
from ..matrix import OperatorMatrix

Blocks = Mapping[Kind, NDArray[np.int64]]
Weights = Mapping[Kind, NDArray[np.float64]]  # (m, q) at the points of each cell


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


def told_without_stiffness(matrix: OperatorMatrix, kind: Kind, cells: NDArray[np.int64]) -> NDArray | None:
    """(m,) areas of straight cells whose mass matrix this is, by least squares; None where they are not determined.

    Entries (e,) and the diagonal have parts of each area that depend on the kind alone.
    """
    given = np.concatenate([matrix.entries, matrix.diagonal])
    if not given.all():  # those of a mass matrix of linear elements are all positive
        return None
    place, product = np.arange(len(cells)), _masses(kind, evenly(kind, np.ones(1)))[0]
    a, b = np.triu_indices(kind.nodes, 1)
    row = np.searchsorted(matrix.edges @ [matrix.n, 1], pairs_of(matrix.n, cells))
    row = np.hstack([row, len(matrix.edges) + cells])
    part = np.append(product[a, b], product.diagonal())
    parts = np.tile(part, len(cells)), (row.ravel(), np.repeat(place, row.shape[1]))
    # Graded meshes: all to the same number of digits.
    weighted = sp.csr_array(sp.diags_array(1 / given) @ sp.csr_array(parts, shape=(len(given), len(cells))))
    unit = sp.diags_array(1 / np.sqrt(weighted.power(2).sum(axis=0)))
    scaled = weighted @ unit
    normal, areas = sp.csr_array(scaled.T @ scaled), np.zeros(len(cells))
    try:
        for _ in range(2):  # the second step takes off the error of normal equations
            areas = areas + unit @ solved(normal, scaled.T @ (1 - weighted @ areas))
    except SolverError:
        return None
    return areas


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
