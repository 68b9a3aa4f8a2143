"""Candidates for cells, of each kind: from the graph alone, put in order by where their nodes lie.

Nothing here depends on more than an affine picture of the points.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..budget import AT_ONCE
from ..tolerances import CANCELLED, MOST
from .cliques import Graph, shared_cliques, simplices, straight_simplices
from .kinds import KINDS, Kind
from .ordering import ordered
from .reference import reference_nodes, shape_gradients
from .surface import contested

# Neighbours and itself, in the mean, of a node of linear simplices; denser graphs have no cells.
_LINEAR = {2: 8, 3: 20}


@dataclass(frozen=True, eq=False)
class Block:
    """Cells of one kind, (m, k) in meshio's order, positively oriented."""

    kind: Kind
    cells: NDArray[np.int64]


def candidates(graph: Graph, points: NDArray[np.float64]) -> Iterator[tuple[Block, ...]]:
    """What could be the cells, those kinds first that have most nodes: of one kind, or triangles beside quadrilaterals.

    The graph couples nodes with coordinates; no more is asked of the points (n, d) than that they are an affine
    picture.
    """
    d, known = points.shape[1], int(np.isfinite(points).all(axis=1).sum())
    kinds = [kind for kind in KINDS.values() if kind.dim == d and kind.degree < 3 and not kind.linear_simplex]
    simplex = KINDS["triangle" if d == 2 else "tetra"]
    for kind in sorted(kinds, key=lambda kind: -kind.nodes):
        sets = shared_cliques(graph, kind.nodes)
        if kind.name == "triangle6":
            sets = np.unique(np.vstack([sets, straight_simplices(graph, points)]), axis=0)
        cells = ordered(sets, points, kind)
        if len(np.unique(cells)) > MOST * known:
            yield (Block(kind, cells),)
        if kind.name == "quad":
            quads = Block(kind, cells[_convex(cells, points, kind)])
            beside = _without_diagonals(graph, quads.cells)
            if len(quads.cells) > 0 and _sparse(beside, d):
                triangles = _simplices(simplex, beside, points)
                if len(triangles.cells):
                    yield triangles, quads
    if _sparse(graph, d):
        yield (_simplices(simplex, graph, points),)


def _sparse(graph: Graph, d: int) -> bool:
    """Whether nodes have as few neighbours as in meshes of linear simplices."""
    return len(graph.row) + graph.n <= graph.n * _LINEAR[d]


def _simplices(kind: Kind, graph: Graph, points: NDArray[np.float64]) -> Block:
    """Cliques of a graph through whose inside no edge runs; only those that overlap need a look."""
    cells = ordered(simplices(graph, kind.dim), points, kind)
    doubtful = np.flatnonzero(contested(kind.base, cells))
    return Block(kind, np.delete(cells, doubtful[~_unpierced(cells[doubtful], points, graph)], axis=0))


def _unpierced(cells: NDArray[np.int64], points: NDArray[np.float64], graph: Graph) -> NDArray[np.bool_]:
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


def _convex(cells: NDArray[np.int64], points: NDArray[np.float64], kind: Kind) -> NDArray[np.bool_]:
    """(m,) boxes, of any degree, whose linear cell is right side out at each corner."""
    linear = KINDS[kind.base]
    at_corners = shape_gradients(linear, reference_nodes(linear))
    jacobian = np.einsum("mke,qkr->mqer", points[cells[:, : kind.corners]], at_corners)
    return np.asarray((np.linalg.det(jacobian) > 0).all(axis=1))


def _without_diagonals(graph: Graph, quads: NDArray[np.int64]) -> Graph:
    """The graph without the diagonals of quadrilaterals (m, 4): what triangles beside them may have for edges."""
    ends = np.sort(quads[:, [[0, 2], [1, 3]]].reshape(-1, 2), axis=1) @ [graph.n, 1]
    left = ~np.isin(np.minimum(graph.row, graph.col) * graph.n + np.maximum(graph.row, graph.col), ends)
    return Graph.of(graph.n, graph.row[left], graph.col[left])
