"""Boxes with simplices beside them: what is left of the graph for these."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .cliques import Graph
from .kinds import Kind, sides
from .reference import reference_nodes, shape_gradients
from .surface import outer_facets


def convex(cells: NDArray[np.int64], points: NDArray[np.float64], kind: Kind) -> NDArray[np.bool_]:
    """(m,) linear boxes that are right side out at each corner."""
    if not len(cells):
        return np.zeros(0, dtype=bool)
    jacobian = np.einsum("mke,qkr->mqer", points[cells], shape_gradients(kind, reference_nodes(kind)))
    return np.asarray((np.linalg.det(jacobian) > 0).all(axis=1))


def without_insides(graph: Graph, base: str, cells: NDArray[np.int64], *, outer: bool) -> Graph:
    """The graph without the pairs of a box that are none of its edges.

    Diagonals of outer facets, which no other box shares, may be edges of tetrahedra there: `outer` keeps them.
    """
    pairs = np.array(list(combinations(range(cells.shape[1]), 2)))
    edge = np.isin(pairs @ [cells.shape[1], 1], np.sort(sides(base), axis=1) @ [cells.shape[1], 1])
    inside = _keys(cells[:, pairs[~edge]].reshape(-1, 2), graph.n)
    if outer and cells.shape[1] > 4:
        (facets,) = outer_facets({base: cells})
        inside = np.setdiff1d(inside, _keys(facets[:, [[0, 2], [1, 3]]].reshape(-1, 2), graph.n))
    return graph.only(~np.isin(_keys(np.column_stack([graph.row, graph.col]), graph.n), inside))


def contained(simplices: NDArray[np.int64], boxes: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(m,) simplices all of whose corners belong to one box."""
    n = int(max(simplices.max(initial=0), boxes.max(initial=0))) + 1
    of = sp.csr_array(
        (np.ones(boxes.size, np.int8), (boxes.ravel(), np.repeat(np.arange(len(boxes)), boxes.shape[1]))),
        shape=(n, len(boxes)),
    )
    common = of[simplices[:, 0]]
    for corner in simplices.T[1:]:
        common = sp.csr_array(common.multiply(of[corner]))
    return np.asarray(common.sum(axis=1) > 0)


def _keys(pairs: NDArray[np.int64], n: int) -> NDArray[np.int64]:
    """Pairs as numbers, whatever their order."""
    return np.asarray(pairs.min(axis=1) * n + pairs.max(axis=1))
