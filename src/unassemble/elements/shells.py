"""Triangles and quadrilaterals between nodes in space or in the plane, read off the graph of a shell."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from .cliques import Graph, shared_cliques, simplices

_FLAT = 0.3  # of its width: how thick a quadrilateral may be


def graph_of(n: int, *cells: NDArray[np.int64]) -> Graph:
    """The graph of n nodes in which those of each cell, (m, k), are coupled to each other."""
    pairs = [some[:, pair] for some in cells for pair in combinations(range(some.shape[1]), 2)]
    return Graph.of(n, *np.concatenate(pairs).T)


def shell_cells(graph: Graph, points: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cliques that are cells: (m, 4) quadrilaterals, after (m, 3) triangles with a side that is none of theirs.

    Nor is that a diagonal. Corners stand in order around the cell; in the plane counter-clockwise.
    """
    quads = _around(points, shared_cliques(graph, 4))
    triangles = simplices(graph, 2)
    triangles = triangles[~graph_of(graph.n, quads).cliques(triangles)]
    return _counter_clockwise(points, triangles), quads


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
