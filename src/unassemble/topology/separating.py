"""3-cycles that are not faces: those with something on both sides."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

_MOST_TESTS = 300


def not_faces(n: int, edges: NDArray, triangles: NDArray, opposite: NDArray) -> NDArray[np.bool_]:
    """Mark 3-cycles that cannot be faces, on graphs where some edge lies on more than two.

    A cycle abc has something on both sides exactly if at least two parts of the rest of the graph
    touch all of a, b and c. Nearly always one of these is a single vertex of degree three inside; such vertices
    are peeled off, round by round. What is then left is tested cycle by cycle.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
    triangles, opposite : (m, 3) int64
        All 3-cycles, and the edges that face their corners.

    Returns
    -------
    (m,) bool
    """
    false = _peel_inner_vertices(n, edges, triangles, opposite)
    count = np.bincount(opposite[~false].ravel(), minlength=len(edges))
    doubtful = np.flatnonzero((count[opposite] > 2).any(axis=1) & ~false)
    if len(doubtful) <= _MOST_TESTS:
        graph = sp.csr_array((np.ones(len(edges), np.int8), edges.T), shape=(n, n))
        false[[k for k in doubtful if _parts_touching_all(graph, triangles[k]) > 1]] = True
    return false


def _peel_inner_vertices(n: int, edges: NDArray, triangles: NDArray, opposite: NDArray) -> NDArray[np.bool_]:
    """Take out vertices of degree three whose neighbours form a cycle; that cycle is no face."""
    false = np.zeros(len(triangles), dtype=bool)
    alive = np.ones(len(triangles), dtype=bool)
    degree = np.bincount(edges.ravel(), minlength=n)
    order, key = _by_edges(len(edges), opposite)
    while True:
        rows = np.flatnonzero(alive)
        count = np.bincount(opposite[rows].ravel(), minlength=len(edges))
        cycles_at = np.bincount(triangles[rows].ravel(), minlength=n)
        inner = (degree == 3) & (cycles_at == 3)
        corner = np.flatnonzero(inner[triangles[rows].ravel()])
        if not len(corner):
            return false
        # Group the three cycles at each inner vertex: their edges facing it are the cycle around it.
        vertex = triangles[rows].ravel()[corner]
        by_vertex = np.argsort(vertex, kind="stable")
        around = np.sort(opposite[rows].ravel()[corner][by_vertex].reshape(-1, 3), axis=1)
        own = rows[corner[by_vertex].reshape(-1, 3) // 3]
        wanted = around[:, 0] * len(edges) + around[:, 2]
        place = np.minimum(np.searchsorted(key, wanted), len(key) - 1)
        cycle = order[place]
        hit = (key[place] == wanted) & (count[around] > 2).all(axis=1) & alive[cycle] & ~false[cycle]
        if not hit.any():
            return false
        cycle, once = np.unique(cycle[hit], return_index=True)
        own = own[hit][once]
        false[cycle] = True  # but alive: once its inside is gone it is like a face to the rest
        alive[own] = False
        degree[vertex[by_vertex].reshape(-1, 3)[hit][once, 0]] = 0
        np.subtract.at(degree, triangles[cycle].ravel(), 1)


def _by_edges(n_edges: int, opposite: NDArray) -> tuple[NDArray, NDArray]:
    """Cycles sorted by their lowest and highest edge, which identify them."""
    key = opposite.min(axis=1) * n_edges + opposite.max(axis=1)
    order = np.argsort(key)
    return order, key[order]


def _parts_touching_all(graph: sp.csr_array, cycle: NDArray) -> int:
    """Components of the graph without the cycle that have neighbours at each of its vertices."""
    n = graph.shape[0]
    whole = graph + graph.T
    keep = np.ones(n, dtype=bool)
    keep[cycle] = False
    number = np.cumsum(keep) - 1
    _, label = csgraph.connected_components(whole[keep][:, keep], directed=False)
    touched = []
    for vertex in cycle:
        neighbours = whole.indices[whole.indptr[vertex] : whole.indptr[vertex + 1]]
        touched.append(set(label[number[neighbours[keep[neighbours]]]].tolist()))
    return len(set.intersection(*touched))
