"""How nearly the entries of a cell are those of an affine one, for any order of its nodes.

On an affine cell the matrix is int grad phi_i' G grad phi_j with one symmetric 2 x 2 matrix G: a combination of three
known ones. So the orders that the graph leaves can be told apart by a linear fit of three numbers; of curved cells,
and quadrilaterals that are no parallelograms, the right order is the one that fits best. A mass term adds a fourth
known matrix, times the area.
"""

from collections.abc import Mapping
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..budget import SAMPLE
from ..elements.kinds import Kind
from ..elements.reference import exact_rule, shape_functions, shape_gradients
from ..matrix import OperatorMatrix
from ..tolerances import ALIKE, LITTLE
from ..topology.keys import found
from .sets import pairs_of


@cache
def _components(kind: Kind, mass: bool) -> NDArray[np.float64]:
    """(k, k, 3 or 4) integrals for the three components of G, and of products of shape functions for a unit area."""
    at, weights = exact_rule(kind)
    x, y = shape_gradients(kind, at).transpose(2, 0, 1)
    products = [(weights, a, b) for a, b in ((x, x), (y, y), (x, y))]
    if mass:
        at, weights = exact_rule(kind, more=1)
        value = shape_functions(kind, at)
        products.append((weights / weights.sum(), value, value))
    parts = [np.einsum("q,qi,qj->ij", *some) for some in products]
    return np.stack([(part + part.T) / 2 for part in parts], axis=-1)


class ElementEntries:
    """Entries among the nodes of cells, split evenly among the cells that have a part in them.

    `sets` (m, k); `every` (p,): keys of the pairs of all cells, of other sizes too, increasing, one for each cell;
    `mass`: whether there is a mass term.
    """

    def __init__(self, matrix: OperatorMatrix, sets: NDArray[np.int64], every: NDArray[np.int64], *, mass: bool):
        self._mass = mass
        m, k = sets.shape
        keys = pairs_of(matrix.n, sets)
        parts = np.searchsorted(every, keys, side="right") - np.searchsorted(every, keys)
        place, there = found(matrix.edges @ [matrix.n, 1], keys)
        value = np.where(there, matrix.entries[place], 0.0) / parts
        # Split evenly is a guess, and beside a flat cell a bad one: what is shared weighs less, all the more if large.
        own = np.sum(value**2, axis=1, where=parts == 1, keepdims=True)
        own = own / np.maximum(np.count_nonzero(parts == 1, axis=1, keepdims=True), 1)
        weight = np.where(parts == 1, 1.0, LITTLE / np.maximum(1.0, value**2 / np.where(own > 0, own, np.inf)))
        a, b = np.triu_indices(k, 1)
        self._values, self._weights = np.zeros((m, k, k)), np.zeros((m, k, k))
        for i, j in ((a, b), (b, a)):
            self._values[:, i, j], self._weights[:, i, j] = value, weight

    def misfit(self, kind: Kind, cells: NDArray[np.int64], order: NDArray[np.int64]) -> NDArray[np.float64]:
        """(c,) squared misfits of some cells (c,) whose nodes, as places in their sets, stand in an order (c, k)."""
        a, b = np.triu_indices(kind.nodes, 1)
        i, j = order[:, a], order[:, b]
        value, weight = self._values[cells[:, None], i, j], self._weights[cells[:, None], i, j]
        columns = _components(kind, self._mass)[a, b]
        normal = np.einsum("mp,pr,ps->mrs", weight, columns, columns, optimize=True)
        right = np.einsum("mp,pr->mr", weight * value, columns)
        total = (weight * value**2).sum(axis=1)
        solution = np.linalg.solve(normal, right[..., None])[..., 0]
        return np.asarray(total - (right * solution).sum(axis=1)) / np.where(total > 0, total, 1.0)

    def masses(self, kind: Kind) -> NDArray[np.float64]:
        """(m,) areas of affine cells in their order, times s: from entries that belong to one cell only."""
        a, b = np.triu_indices(kind.nodes, 1)
        columns, own, found = _components(kind, True)[a, b], self._weights[:, a, b] == 1, np.zeros(len(self._values))
        label = own @ (1 << np.arange(len(a)))
        for one in np.unique(label):  # few: sides are shared or not
            some = np.flatnonzero(label == one)
            mine = own[some[0]]
            found[some] = self._values[some][:, a[mine], b[mine]] @ np.linalg.pinv(columns[mine])[3]
        return found


def expected(
    places: Mapping[Kind, NDArray[np.int64]], shares: NDArray, trust: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(e,) entries of cells that are affine, each with nearly those shares, (e,), of its pairs of nodes.

    `places`: rows of the pairs of each cell, (m, pairs); `trust` (e,): weights of the shares.
    """
    total = np.zeros(len(shares))
    for kind, own in places.items():
        columns = _components(kind, False)[np.triu_indices(kind.nodes, 1)]
        normal = np.einsum("mp,pr,ps->mrs", trust[own], columns, columns, optimize=True)
        size = np.trace(normal, axis1=1, axis2=2)[:, None, None]
        normal = normal + (ALIKE * size + np.finfo(float).tiny) * np.eye(3)
        right = np.einsum("mp,pr->mr", trust[own] * shares[own], columns)
        cells = np.linalg.solve(normal, right[..., None])[..., 0] @ columns.T
        total += np.bincount(own.ravel(), cells.ravel(), len(shares))
    return total


def typical_misfit(matrix: OperatorMatrix, blocks: Mapping[Kind, NDArray[np.int64]]) -> float:
    """Median misfit of some cells in their order, 0 for affine ones and at most 1; of several kinds the largest."""
    every = np.sort(np.concatenate([pairs_of(matrix.n, cells).ravel() for cells in blocks.values()]))
    found = []
    for kind, cells in blocks.items():
        some = cells[:: len(cells) // SAMPLE + 1]
        order = np.broadcast_to(np.arange(kind.nodes), some.shape)
        found.append(
            float(np.median(ElementEntries(matrix, some, every, mass=False).misfit(kind, np.arange(len(some)), order)))
        )
    return max(found)
