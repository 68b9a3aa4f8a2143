"""Members and shell cells, read off coupled nodes whose positions are known."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elements.cliques import Graph, shared_cliques, simplices
from ..nodes.nodal import determined
from ..topology.keys import contains, pair_keys
from .nodes import Nodes

_ALONE = 1e-9  # relative misfit of a pair of nodes that balances by itself
_FLAT = 0.3  # of its width: how thick a quadrilateral may be

_SIDES = ((0, 1), (1, 2), (2, 3), (3, 0))


def members_and_cells(nodes: Nodes, points: NDArray[np.float64]) -> dict[str, NDArray[np.int64]]:
    """Straight members between two nodes, and triangles and quadrilaterals between more.

    A member of constant section turns with a rigid rotation of its two nodes all by itself, which a pair of corners of
    a shell element does not: so each pair tells what it is. Cells are cliques of the others; a pair of which none is
    part of a cell is a member too.

    Parameters
    ----------
    nodes : Nodes
    points : (n, d) float64
        NaN where not determined.

    Returns
    -------
    dict
        ``lines`` (m, 2), ``triangles`` (m, 3) and ``quads`` (m, 4): corners in order around the cell; in the plane
        counter-clockwise.
    """
    i, j = sp.triu(nodes.graph, 1).nonzero()
    known = determined(points)
    real = known[i] & known[j]
    i, j = i[real].astype(np.int64), j[real].astype(np.int64)
    alone = _balanced(nodes, points, i, j)
    n = nodes.n
    graph = Graph(_pattern(n, i[~alone], j[~alone]))
    quads = _around(points, shared_cliques(graph, 4))
    sides = [np.sort(quads[:, side], axis=1) for side in _SIDES]
    inside = [*sides, np.sort(quads[:, [0, 2]], axis=1), np.sort(quads[:, [1, 3]], axis=1)]
    taken = np.unique(_keys(n, inside))
    triangles = simplices(graph, 2)
    pairs = [triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]]
    within = np.all([contains(taken, pair_keys(n, *pair.T)) for pair in pairs], axis=0)
    triangles = triangles[~within]
    covered = np.unique(np.concatenate([taken, _keys(n, [pair[~within] for pair in pairs])]))
    lone = alone | ~contains(covered, pair_keys(n, i, j))
    lines = np.column_stack([i[lone], j[lone]])
    return {"lines": lines, "triangles": _counter_clockwise(points, triangles), "quads": quads}


def _balanced(nodes: Nodes, points: NDArray, i: NDArray, j: NDArray) -> NDArray[np.bool_]:
    """(e,) pairs whose blocks alone annihilate rotations about one of the nodes.

    Of a member of constant section, both ends' rotations act alike on the forces, so that the block of the pair tells
    that of the node with itself: A_ij (w x (x_j - x_i)) + 2 A_ij w = 0 in the rows of forces.
    """
    layout = nodes.layout
    b, moves = layout.block_size, len(layout.displacements)
    blocks = nodes.matrix.tobsr((b, b))
    blocks.sort_indices()
    row = np.repeat(np.arange(nodes.n), np.diff(blocks.indptr))
    key = pair_keys(nodes.n, row, blocks.indices.astype(np.int64))
    upper = row <= blocks.indices
    place = np.flatnonzero(upper)[np.searchsorted(key[upper], pair_keys(nodes.n, i, j))]
    block = blocks.data[place][:, :moves]
    motion = layout.rigid_motions(points[j] - points[i])[:, :, moves:]
    motion[:, moves:] *= 2
    force = block @ motion
    size = np.abs(block) @ np.abs(motion)
    # Every force counts by the largest: those that are rounding say nothing of themselves.
    return np.asarray(np.abs(force).max(axis=(1, 2), initial=0) <= _ALONE * size.max(axis=(1, 2), initial=0))


def _pattern(n: int, i: NDArray, j: NDArray) -> sp.csr_array:
    pair = np.concatenate([i, j]), np.concatenate([j, i])
    return sp.csr_array((np.ones(2 * len(i), np.int8), pair), shape=(n, n))


def _keys(n: int, pairs: list[NDArray]) -> NDArray[np.int64]:
    every = np.concatenate(pairs)
    return pair_keys(n, every[:, 0], every[:, 1])


def _around(points: NDArray, cliques: NDArray[np.int64]) -> NDArray[np.int64]:
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


def _counter_clockwise(points: NDArray, cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cells in the plane turned to run counter-clockwise; those in space as they are."""
    if points.shape[1] == 3 or not len(cells):
        return cells
    first, second = points[cells[:, 1]] - points[cells[:, 0]], points[cells[:, -1]] - points[cells[:, 0]]
    clockwise = first[:, 0] * second[:, 1] < first[:, 1] * second[:, 0]
    return np.where(clockwise[:, None], cells[:, ::-1], cells)
