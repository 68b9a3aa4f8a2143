"""Mass matrices of cells, to be taken off: by weights, density times area, at the points of a quadrature.

Areas are told by entries that straight triangles of second and third order share with no other cell: int grad phi_a .
grad phi_b vanishes for a corner and the side of a quadratic one that faces it, int phi_a phi_b does not. Linear
triangles have no such entries, and quadrilaterals two, fewer than the numbers that they depend on: there areas are
guessed from row sums, s times the integrals of the basis functions.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..elements.kinds import Kind
from ..elements.reference import Rule, exact_rule, shape_functions, shape_gradients
from ..matrix import OperatorMatrix
from ..topology.keys import found
from .affine import ElementEntries
from .sets import pairs_of

Blocks = Mapping[Kind, NDArray[np.int64]]
Weights = Mapping[Kind, NDArray[np.float64]]  # (m, q) at the points of each cell


def _rule(kind: Kind) -> Rule:
    return exact_rule(kind, more=1)


def told_by_entries(matrix: OperatorMatrix, blocks: Blocks) -> Weights | None:
    """Weights of straight triangles in their order; None for other cells."""
    if not all(kind.simplex and kind.degree > 1 for kind in blocks):
        return None
    every = np.sort(np.concatenate([pairs_of(matrix.n, cells).ravel() for cells in blocks.values()]))
    return {
        kind: _spread(kind, ElementEntries(matrix, cells, every, mass=True).masses(kind))
        for kind, cells in blocks.items()
    }


def guessed_from_sums(sums: NDArray[np.float64], blocks: Blocks) -> Weights:
    """Weights that share each row sum (n,) evenly among the cells of its row."""
    count = sum(np.bincount(cells.ravel(), minlength=len(sums)) for cells in blocks.values())
    return {kind: _spread(kind, (sums / np.maximum(count, 1))[cells].sum(axis=1)) for kind, cells in blocks.items()}


def _spread(kind: Kind, areas: NDArray[np.float64]) -> NDArray[np.float64]:
    weights = _rule(kind)[1]
    return np.outer(areas, weights / weights.sum())


def weights_at(points: NDArray[np.float64], blocks: Blocks) -> Weights:
    """Areas at the points of each cell of a mesh (n, 2)."""
    areas = {}
    for kind, cells in blocks.items():
        at, weights = _rule(kind)
        moved = (points[cells] - points[cells[:, :1]]).transpose(2, 0, 1)
        (xs, ys), (xt, yt) = (moved @ slopes.T for slopes in shape_gradients(kind, at).transpose(2, 0, 1))
        areas[kind] = np.abs(xs * yt - xt * ys) * weights
    return areas


def less(matrix: OperatorMatrix, blocks: Blocks, weights: Weights) -> OperatorMatrix:
    """A matrix without the mass matrix that cells of these weights have."""
    off, own = matrix.entries.copy(), matrix.diagonal.copy()
    stored = matrix.edges @ [matrix.n, 1]
    for kind, cells in blocks.items():
        value = shape_functions(kind, _rule(kind)[0])
        a, b = np.triu_indices(kind.nodes, 1)
        place, there = found(stored, pairs_of(matrix.n, cells))  # what vanished is left alone
        products = weights[kind] @ (value[:, a] * value[:, b])
        off -= np.bincount(place[there], products[there], len(off))
        own -= np.bincount(cells.ravel(), (weights[kind] @ value**2).ravel(), matrix.n)
    return replace(matrix, entries=off, diagonal=own)
