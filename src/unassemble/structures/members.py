"""Members between two nodes: what a structure consists of, and whether they show that its rows were joined rightly.

What a straight member between two nodes transmits balances by itself, whatever its section; what a pair of corners of a
shell element transmits does not. So each pair of coupled nodes tells what it is.
"""

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elements.cliques import Graph, shared_cliques, simplices
from ..nodes.constants import row_sizes
from ..nodes.nodal import determined
from ..tolerances import CANCELLED
from .layouts import PLANE
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
    alone = np.logical_and(*_balanced(nodes, points, pairs[:, 0], pairs[:, 1], allowed))
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


def mispaired(
    nodes: Nodes, points: NDArray[np.float64], inner: NDArray[np.bool_], allowed: float
) -> tuple[int, int] | None:
    """Two nodes that are not coupled as elements couple them, if there are any.

    The equations for coordinates add up the columns of each direction, and so hardly tell which row of one direction
    and which of another are one node's. The couplings do: elements join whole nodes, so that two nodes meet in several
    directions or in none. In space each coordinate acts on two directions, which contradict each other where their rows
    are not one node's; the coordinates of a plate act on one direction. Those of a plane frame have a direction each,
    so that all depends on the pairing: its nodes have to be joined by members, and no two of them to have the same
    neighbours. What was condensed joins the nodes next to it otherwise; these need a member to another node. `inner`
    (n,) are nodes whose forces are touched neither by supports nor by what was condensed.
    """
    n, b = nodes.n, nodes.layout.block_size
    coo, size = nodes.matrix.tocoo(), np.minimum(np.abs(nodes.matrix.diagonal()), row_sizes(nodes.matrix))
    real = np.abs(coo.data) > CANCELLED * np.sqrt(size[coo.row] * size[coo.col])  # penalties are no measure
    (i, one), (j, other) = np.divmod(coo.row[real], b), np.divmod(coo.col[real], b)
    near, meeting = _counts(i, j, n), _counts(i[one == other], j[one == other], n)
    first, second = sp.triu(near, 1).nonzero()
    shared = (nodes.present[first] & nodes.present[second]).sum(axis=1)
    known = determined(points)
    strange = np.asarray(meeting[first, second]).ravel() < np.minimum(shared, 2)
    if not nodes.layout.rotations:  # bars along an axis have one direction
        strange &= ~_balanced(nodes, points, first, second, allowed)[0]
    if nodes.layout == PLANE:
        pattern = (near > 0).astype(np.int32)
        degree, common = np.diff(near.indptr), np.asarray((pattern @ pattern)[first, second]).ravel()
        twins = (common == degree[first]) & (common == degree[second])
        balanced, whole = _balanced(nodes, points, first, second, allowed)
        joined = np.zeros(n, dtype=bool)
        joined[first[whole & balanced]] = joined[second[whole & balanced]] = True
        excused = ~inner[first] & ~inner[second] & joined[first] & joined[second]
        strange |= twins | (whole & ~balanced & ~excused)
    strange &= known[first] | known[second]
    k = int(np.argmax(strange)) if strange.any() else None
    return None if k is None else (int(first[k]), int(second[k]))


def _counts(i: NDArray, j: NDArray, n: int) -> sp.csr_array:
    return sp.csr_array((np.ones(len(i), np.int32), (i, j)), shape=(n, n))


def _balanced(nodes: Nodes, points: NDArray, i: NDArray, j: NDArray, allowed: float) -> tuple[NDArray, NDArray]:
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
