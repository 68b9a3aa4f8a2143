"""Candidates for cells, of each kind: from the graph alone, put in order by where their nodes lie.

Nothing here depends on more than an affine picture of the points.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..tolerances import MOST
from .cliques import Graph, shared_cliques, simplices, straight_simplices
from .kinds import KINDS, Kind
from .ordering import ordered
from .overlap import convex, unpierced, without_diagonals
from .surface import contested

_LINEAR = {
    2: 8,
    3: 20,
}  # neighbours and itself, in the mean, of a node of linear simplices; denser graphs have no cells


@dataclass(frozen=True, eq=False)
class Block:
    """Cells of one kind, (m, k) in meshio's order, positively oriented."""

    kind: Kind
    cells: NDArray[np.int64]


def candidates(graph: Graph, points: NDArray[np.float64]) -> Iterator[tuple[Block, ...]]:
    """What could be the cells, those kinds first that have most nodes: of one kind, or triangles beside quadrilaterals.

    Parameters
    ----------
    graph : Graph
        Coupled nodes; nodes without coordinates are coupled to none.
    points : (n, d) float64
    """
    d, known = points.shape[1], int(np.isfinite(points).all(axis=1).sum())
    known_kinds = (kind for kind in KINDS.values() if kind.dim == d and kind.degree < 3 and not kind.linear_simplex)
    kinds = {kind.name: kind for kind in known_kinds}
    simplex = KINDS["triangle" if d == 2 else "tetra"]
    for kind in sorted(kinds.values(), key=lambda kind: -kind.nodes):
        sets = shared_cliques(graph, kind.nodes)
        if kind.name == "triangle6":
            sets = np.unique(np.vstack([sets, straight_simplices(graph, points)]), axis=0)
        cells = ordered(sets, points, kind)
        if len(np.unique(cells)) > MOST * known:
            yield (Block(kind, cells),)
        if kind.name == "quad":
            quads = Block(kind, cells[convex(cells, points, kind)])
            beside = without_diagonals(graph, quads.cells)
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
    return Block(kind, np.delete(cells, doubtful[~unpierced(cells[doubtful], points, graph)], axis=0))
