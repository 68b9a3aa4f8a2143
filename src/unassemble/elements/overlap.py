"""Cliques that are no cells: those that an edge of the graph runs through, and those inside other cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..budget import AT_ONCE
from ..tolerances import CANCELLED
from .cliques import Graph
from .kinds import KINDS, Kind
from .reference import reference_nodes, shape_gradients


def unpierced(cells: NDArray[np.int64], points: NDArray[np.float64], graph: Graph) -> NDArray[np.bool_]:
    """(m,) whether no edge of the graph leaves a corner into the inside of the simplex, or into a facet.

    Where three tetrahedra surround an edge, the corners of two of the larger ones that they make up are cliques as
    well; the edge runs through both. The simplices are not flat.
    """
    whole = np.ones(len(cells), dtype=bool)
    if not len(cells):
        return whole
    per_cell = max(int(np.diff(graph.start)[cells[:, 0]].mean()), 1)
    step = max(AT_ONCE // per_cell, 1)
    for start in range(0, len(cells), step):
        some = cells[start : start + step]
        for a in range(cells.shape[1]):
            corner = points[some[:, a]]
            spanned = points[np.delete(some, a, axis=1)] - corner[:, None]
            place, neighbour = graph.spread(some[:, a])
            direction = points[neighbour] - corner[place]
            within = np.einsum("pa,pab->pb", direction, np.linalg.inv(spanned)[place])
            enters = (within > -CANCELLED).all(axis=1) & ((within > CANCELLED).sum(axis=1) > 1)
            whole[start + place[enters]] = False
    return whole


def convex(cells: NDArray[np.int64], points: NDArray[np.float64], kind: Kind) -> NDArray[np.bool_]:
    """(m,) boxes, of any degree, whose linear cell is right side out at each corner."""
    linear = KINDS[kind.base]
    at_corners = shape_gradients(linear, reference_nodes(linear))
    jacobian = np.einsum("mke,qkr->mqer", points[cells[:, : kind.corners]], at_corners)
    return np.asarray((np.linalg.det(jacobian) > 0).all(axis=1))


def without_diagonals(graph: Graph, quads: NDArray[np.int64]) -> Graph:
    """The graph without the diagonals of quadrilaterals (m, 4): what triangles beside them may have for edges."""
    ends = np.sort(quads[:, [[0, 2], [1, 3]]].reshape(-1, 2), axis=1) @ [graph.n, 1]
    own = np.minimum(graph.row, graph.col) * graph.n + np.maximum(graph.row, graph.col)
    return graph.only(~np.isin(own, ends))
