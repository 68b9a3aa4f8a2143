"""Chordless 4-cycles of a sparse graph, by array code."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .adjacency import adjacency, neighbours
from .faces import joined


def chordless_four_cycles(n: int, edges: NDArray, usable: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Cycles a-b-c-d of usable edges, with neither a-c nor b-d an edge.

    Each cycle is found once, from its vertex of highest rank (degree, then number) and the two-edge paths that
    leave it over vertices of lower rank: linear in the number of edges on planar graphs (Chiba and Nishizeki,
    SIAM J. Comput. 14, 1985).

    `edges` (e, 2): pairs i < j in lexicographic order; `usable` (e,).

    Returns (m, 4) vertices in running order.
    """
    pairs = edges[usable]
    if not len(pairs):
        return np.empty((0, 4), np.int64)
    degree = np.bincount(pairs.ravel(), minlength=n)
    rank = np.empty(n, dtype=np.int64)
    rank[np.argsort(degree, kind="stable")] = np.arange(n)
    graph = adjacency(n, pairs)
    tail = np.repeat(np.arange(n), np.diff(graph.indptr))
    down = rank[tail] > rank[graph.indices]
    top, middle = tail[down], graph.indices[down].astype(np.int64)
    # All neighbours `end` of `middle` that rank below `top`.
    path, end = neighbours(graph, middle)
    top, middle = top[path], middle[path]
    kept = rank[end] < rank[top]
    top, middle, end = top[kept], middle[kept], end[kept]
    order = np.lexsort((middle, end, top))
    top, middle, end = top[order], middle[order], end[order]
    found = []
    key = top * n + end
    # Of four or more paths between the same ends every one has three neighbours: that many cycles through an
    # edge are enough to know that not all of them are faces.
    for step in (1, 2, 3):
        first = np.flatnonzero(key[step:] == key[:-step])
        found.append(np.column_stack([top[first], middle[first], end[first], middle[first + step]]))
    cycles = np.concatenate(found)
    a, b, c, d = cycles.T
    return cycles[~(joined(n, edges, a, c) | joined(n, edges, b, d))]
