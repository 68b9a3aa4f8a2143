"""Members between two nodes, and shell cells between more: what a structure consists of.

What a straight member between two nodes transmits balances by itself, whatever its section; what a pair of corners of a
shell element transmits does not. So each pair of coupled nodes tells what it is.
"""

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elements.cliques import Graph, shared_cliques, simplices
from ..nodes.nodal import determined
from .nodes import Nodes
from .straight import blocks_at

_FLAT = 0.3  # of its width: how thick a quadrilateral may be
_MOST_PER_NODE = 4  # triangles of surfaces, of which two are a quadrilateral: by Euler two a node, more where they meet


def members_and_cells(nodes: Nodes, points: NDArray[np.float64], allowed: float) -> dict[str, NDArray[np.int64]]:
    """Straight members between two nodes, and triangles and quadrilaterals between more.

    Cells are cliques of pairs that are no members; a pair of which none is part of a cell is a member too. What is
    `allowed` may be left of forces that balance. Returns ``lines`` (m, 2), ``triangles`` (m, 3) and ``quads`` (m, 4):
    corners in order around the cell; in the plane counter-clockwise.
    """
    pairs = np.column_stack(sp.triu(nodes.graph, 1).nonzero()).astype(np.int64)
    pairs = pairs[determined(points)[pairs].all(axis=1)]
    alone = np.logical_and(*balanced(nodes, points, pairs[:, 0], pairs[:, 1], allowed))
    graph = _graph_of(nodes.n, pairs[~alone])
    quads, triangles = _around(points, shared_cliques(graph, 4)), simplices(graph, 2)
    inside = _graph_of(nodes.n, quads).cliques(triangles)  # all sides are those of quadrilaterals, or diagonals
    triangles = _counter_clockwise(points, triangles[~inside])
    if len(triangles) + 2 * len(quads) > _MOST_PER_NODE * nodes.n:  # faces of solids, and planes through them
        triangles, quads = triangles[:0], quads[:0]
    else:
        alone |= ~_graph_of(nodes.n, triangles, quads).coupled(*pairs.T)
    return {"lines": pairs[alone], "triangles": triangles, "quads": quads}


def _graph_of(n: int, *cells: NDArray[np.int64]) -> Graph:
    """The graph of n nodes in which those of each cell, (m, k), are coupled to each other."""
    pairs = [some[:, pair] for some in cells for pair in combinations(range(some.shape[1]), 2)]
    return Graph.of(n, *np.concatenate(pairs).T)


def _around(points: NDArray[np.float64], cliques: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those of four nodes that lie around a flat quadrilateral, in order."""
    if not len(cliques):
        return cliques
    x = points[cliques] - points[cliques].mean(axis=1, keepdims=True)
    _, size, axes = np.linalg.svd(x, full_matrices=False)
    flat = size[:, 1] > 0
    if points.shape[1] == 3:
        flat &= size[:, 2] <= _FLAT * size[:, 1]
    across = x @ axes[:, :2].transpose(0, 2, 1)
    order = np.argsort(np.arctan2(across[..., 1], across[..., 0]), axis=1)
    return _counter_clockwise(points, np.take_along_axis(cliques, order, axis=1)[flat])


def _counter_clockwise(points: NDArray[np.float64], cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cells in the plane turned to run counter-clockwise; those in space as they are."""
    if points.shape[1] == 3 or not len(cells):
        return cells
    first, second = points[cells[:, 1]] - points[cells[:, 0]], points[cells[:, -1]] - points[cells[:, 0]]
    clockwise = first[:, 0] * second[:, 1] < first[:, 1] * second[:, 0]
    return np.where(clockwise[:, None], cells[:, ::-1], cells)


def balanced(nodes: Nodes, points: NDArray, i: NDArray, j: NDArray, allowed: float) -> tuple[NDArray, NDArray]:
    """Pairs whose block is a member's, whatever its section; and those that are known as a whole.

    Forces at both ends balance for every motion of one of them: with T the motion of node i that goes with one of node
    j, T^T A_ij is minus the member's own block of node j, and symmetric.
    """
    b = nodes.layout.block_size
    block = blocks_at(nodes.matrix, b * i, b * j, b)
    turn = nodes.layout.rigid_motions(points[i] - points[j]).transpose(0, 2, 1)
    left = turn @ block
    left = np.pad(left, ((0, 0), (0, 0), (0, left.shape[1] - left.shape[2])))  # what no rotation takes up has to vanish
    off = np.abs(left - left.transpose(0, 2, 1)).max(axis=(1, 2), initial=0)
    whole = (nodes.present[i] & nodes.present[j]).all(axis=1) & determined(points)[i] & determined(points)[j]
    size = (np.abs(turn) @ np.abs(block)).max(axis=(1, 2), initial=0)
    return off <= 10 * allowed * size, whole
