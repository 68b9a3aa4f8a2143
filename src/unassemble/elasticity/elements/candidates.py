"""Candidates for cells, of each kind: from the graph alone, put in order by where their nodes lie.

Nothing here depends on more than an affine picture of the points.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodal import NodalMatrix, determined
from .boxes import contained, convex, without_insides
from .cliques import Graph, shared_cliques, simplices, straight_simplices
from .hidden import hidden_cliques
from .kinds import KINDS, Kind
from .ordering import ordered
from .piercing import unpierced
from .surface import contested

_COVERED = 0.5  # of the nodes: what cells have to touch before they are tried
_LINEAR = {2: 8, 3: 20}  # blocks per row, at most, in meshes of linear simplices; others have too many cliques to try


@dataclass(frozen=True, eq=False)
class Block:
    """Cells of one kind, (m, k) in meshio's order, positively oriented."""

    kind: Kind
    cells: NDArray[np.int64]


def candidates(
    graph: Graph,
    points: NDArray[np.float64],
    complete: NDArray[np.bool_],
    *,
    linear_simplices: bool = True,
    wider: Graph | None = None,
) -> Iterator[tuple[Block, ...]]:
    """What could be the cells, those kinds first that have most nodes: of one kind, then simplices beside boxes.

    Parameters
    ----------
    graph : Graph
        See :func:`coupled`.
    points : (n, d) float64
        NaN where not determined; such nodes are in no cell.
    complete : (n,) bool
        Nodes all of whose cells are there.
    linear_simplices : bool
        Whether to look for these, too; of some graphs there are many.
    wider : Graph, optional
        The same with pairs all of whose entries may have been taken out; see :func:`perhaps_coupled`.
    """
    d, known = points.shape[1], int(determined(points).sum())
    boxes, simplex = None, None
    kinds = [kind for kind in KINDS.values() if kind.dim == d and (linear_simplices or not kind.linear_simplex)]
    for kind in sorted(kinds, key=lambda kind: -kind.nodes):
        if kind.linear_simplex:
            simplex = kind
            if len(graph.row) + graph.n <= graph.n * _LINEAR[d]:
                yield (_simplices(kind, graph, points, graph),)
            continue
        sets = _sets(kind, graph, points)
        cells = ordered(sets, points, kind)
        if len(np.unique(cells)) > _COVERED * known:
            yield (Block(kind, cells),)
            if kind.simplex and wider is not None:
                more = np.unique(np.vstack([sets, straight_simplices(wider, points, kind.dim)]), axis=0)
                if len(more) > len(sets):
                    yield (Block(kind, ordered(more, points, kind)),)
            if not kind.simplex:
                hidden = _convex(kind, ordered(hidden_cliques(graph, sets, kind.nodes), points, kind), points)
                if len(hidden.cells):
                    cells = np.vstack([cells, hidden.cells])
                    yield (Block(kind, cells),)
        if not kind.quadratic:
            boxes = _convex(kind, cells, points)
    if boxes is not None and simplex is not None and len(boxes.cells):
        beside = without_insides(graph, boxes.kind.base, boxes.cells, outer=True)
        if len(beside.row) + graph.n <= graph.n * _LINEAR[d]:
            edges = without_insides(graph, boxes.kind.base, boxes.cells, outer=False)
            edges = edges.only(complete[edges.row] | complete[edges.col])  # others may belong to boxes that are gone
            rest = _simplices(simplex, beside, points, edges)
            rest = replace(rest, cells=rest.cells[~contained(rest.cells, boxes.cells)])
            if len(rest.cells):
                yield (rest, boxes)


def _convex(kind: Kind, cells: NDArray[np.int64], points: NDArray) -> Block:
    """The boxes that are right side out at each corner."""
    corners = KINDS[kind.base]
    return Block(kind, cells[convex(cells[:, : kind.corners], points, corners)])


def _sets(kind: Kind, graph: Graph, points: NDArray) -> NDArray[np.int64]:
    """Sets of nodes that could be the cells of a kind."""
    sets = shared_cliques(graph, kind.nodes)
    if kind.name == "triangle6":
        sets = np.unique(np.vstack([sets, straight_simplices(graph, points, kind.dim)]), axis=0)
    return sets


def _simplices(kind: Kind, graph: Graph, points: NDArray, edges: Graph) -> Block:
    """Cliques of a graph through whose inside no edge runs; only those that overlap need a look."""
    cells = ordered(simplices(graph, kind.dim), points, kind)
    doubtful = np.flatnonzero(contested(kind.base, cells))
    return Block(kind, np.delete(cells, doubtful[~unpierced(cells[doubtful], points, edges)], axis=0))


def coupled(nodal: NodalMatrix, points: NDArray) -> Graph:
    """Pairs of determined nodes with an entry that is not zero, or that lack some, which may not have been zero."""
    known, lacking = determined(points), np.asarray((nodal.row_of < 0).any(axis=1))
    i, j = nodal.node, nodal.indices
    live = np.abs(nodal.data).max(axis=(1, 2)) > 1e-13 * np.minimum(nodal.size[i], nodal.size[j])  # symmetric
    live |= lacking[i] | lacking[j]
    live &= known[i] & known[j]
    return Graph(sp.csr_array((np.ones(live.sum()), (i[live], j[live])), shape=(nodal.n,) * 2))


def perhaps_coupled(nodal: NodalMatrix, graph: Graph) -> Graph:
    """Coupled pairs, and those of two nodes that both lack a direction and have half of a cell's nodes in common.

    Where entries that vanish are not stored, those that such nodes had may all have been taken out.
    """
    lacking = np.flatnonzero((nodal.row_of < 0).any(axis=1))
    closed = graph.closed()
    around = closed[lacking]
    common = sp.coo_array(around @ around.T)
    near = common.data > nodal.dim + 1
    i, j = lacking[common.row[near]], lacking[common.col[near]]
    more = sp.csr_array((np.ones(len(i), np.int32), (i, j)), shape=(graph.n, graph.n))
    return Graph(sp.csr_array(closed + more))
