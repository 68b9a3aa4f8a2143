"""Planarity by the edge-addition method, through ``planarity`` where it is installed, else networkx."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

try:
    import planarity as _suite
except ImportError:  # no wheels for this platform: networkx has the left-right test in pure Python
    _suite = None


def is_planar(n: int, edges: NDArray) -> bool:
    """Whether the graph can be drawn without crossings."""
    if n >= 3 and len(edges) > 3 * n - 6:
        return False
    if _suite is not None:
        return bool(_suite.is_planar(edges.tolist()))
    import networkx

    return bool(networkx.check_planarity(networkx.Graph(edges.tolist()))[0])


def kuratowski_edges(n: int, edges: NDArray) -> tuple[tuple[int, int], ...]:
    """Edges of a subdivision of K5 or K3,3 in a graph that is not planar, each pair in increasing order."""
    if n >= 3:  # any 3 n - 5 edges will do
        edges = edges[: 3 * n - 5]
    if _suite is not None:
        pairs = [pair[:2] for pair in _suite.kuratowski_edges(edges.tolist())]
    else:
        import networkx

        graph = networkx.Graph(edges.tolist())
        pairs = networkx.check_planarity(graph, counterexample=True)[1].edges()
    return tuple(sorted((min(a, b), max(a, b)) for a, b in pairs))


def triangular_faces(n: int, edges: NDArray) -> tuple[NDArray, NDArray]:
    """Faces with three edges of one planar embedding.

    Returns
    -------
    triangles : (m, 3) int64
        Vertices.
    opposite : (m, 3) int64
        Rows of `edges` that face the corners.
    """
    tail, head = _rotation_system(n, edges)
    key = np.minimum(tail, head) * n + np.maximum(tail, head)
    edge = np.searchsorted(edges[:, 0] * n + edges[:, 1], key)
    successor = _next_along_face(n, tail, head)
    second = successor[np.arange(len(tail))]
    third = successor[second]
    start = np.arange(len(tail))
    # Count each face once, at its lowest half-edge; a loop along a bridge has no three different vertices.
    closed = (successor[third] == start) & (start < second) & (start < third)
    closed &= (tail != tail[second]) & (tail[second] != tail[third]) & (tail[third] != tail)
    a, b, c = start[closed], second[closed], third[closed]
    return np.column_stack([tail[a], tail[b], tail[c]]), np.column_stack([edge[b], edge[c], edge[a]])


def _next_along_face(n: int, tail: NDArray, head: NDArray) -> NDArray:
    """From a -> b to b -> c, where c follows a in the rotation about b."""
    count = len(tail)
    order = np.lexsort((head, tail))
    position = np.empty(count, dtype=np.int64)  # of each half-edge's twin
    key = tail[order] * n + head[order]
    position = order[np.searchsorted(key, head * n + tail)]
    last = np.append(np.flatnonzero(np.diff(tail)), count - 1)
    turn = np.arange(1, count + 1)
    turn[last] = np.append(0, last[:-1] + 1)
    return turn[position]


def _rotation_system(n: int, edges: NDArray) -> tuple[NDArray, NDArray]:
    """Half-edges tail -> head, grouped by tail, each group in cyclic order about it."""
    import networkx

    _, embedding = networkx.check_planarity(networkx.Graph(edges.tolist()))
    pairs = [(v, w) for v in sorted(embedding) for w in embedding.neighbors_cw_order(v)]
    half_edges = np.array(pairs, dtype=np.int64)
    return half_edges[:, 0], half_edges[:, 1]
