"""The short cycles of a sparse graph: 3-cycles, those with something on both sides, 4-cycles without chords."""

from collections.abc import Callable, Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import LARGE
from .faces import joined
from .keys import contains, distinct
from .numbering import adjacency, connected, neighbours


def three_cycles(n: int, edges: NDArray) -> tuple[NDArray, NDArray]:
    """All 3-cycles of a simple graph.

    Each edge is directed towards its end of higher degree, so that few edges leave a vertex even
    where hubs exist, and every pair of edges leaving a vertex is tested for the closing edge: the
    "forward" algorithm, linear in the number of edges on planar graphs (Chiba and Nishizeki, SIAM
    J. Comput. 14, 1985).

    `n`: number of vertices; `edges` (e, 2): pairs i < j in lexicographic order.

    Returns `triangles` (m, 3): vertices, in no particular orientation; `opposite` (m, 3): the row of `edges` that faces
    each corner.
    """
    degree = np.bincount(edges.ravel(), minlength=n)
    swap = degree[edges[:, 0]] > degree[edges[:, 1]]
    tail = np.where(swap, edges[:, 1], edges[:, 0])
    order = np.argsort(tail, kind="stable")
    tail = tail[order]
    head = np.where(swap, edges[:, 0], edges[:, 1])[order]
    edge_id = lookup(n, edges)
    found = [np.empty((3, 0), np.int64)]
    for first, second in pairs_in_runs(tail):
        closing = edge_id(head[first], head[second])
        found.append(np.stack([first, second, closing])[:, closing >= 0])
    first, second, closing = np.concatenate(found, axis=1)
    triangles = np.column_stack([tail[first], head[first], head[second]])
    return triangles, np.column_stack([closing, order[second], order[first]])


def pairs_in_runs(label: NDArray) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """All pairs of places (k,) with equal labels among sorted ones, those next to each other first."""
    first, step = np.arange(len(label)), 1
    while True:
        first = first[first + step < len(label)]
        first = first[label[first] == label[first + step]]
        if not len(first):
            return
        yield first, first + step
        step += 1


def lookup(n: int, edges: NDArray) -> Callable[[NDArray, NDArray], NDArray]:
    """A function from pairs of vertices to rows of `edges`, -1 where there is no edge."""
    indptr = np.zeros(n + 1, dtype=np.int32)
    np.cumsum(np.bincount(edges[:, 0], minlength=n), out=indptr[1:])
    numbered = sp.csr_array(
        (np.arange(1, len(edges) + 1, dtype=np.int32), edges[:, 1].astype(np.int32), indptr), shape=(n, n)
    )
    numbered.has_canonical_format = True  # lets scipy search rows by bisection

    def lookup(a: NDArray, b: NDArray) -> NDArray:
        return np.asarray(numbered[np.minimum(a, b), np.maximum(a, b)]).ravel().astype(np.int64) - 1

    return lookup


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


def not_faces(n: int, edges: NDArray, triangles: NDArray, opposite: NDArray) -> NDArray[np.bool_]:
    """Mark 3-cycles that cannot be faces, on graphs where some edge lies on more than two.

    A cycle abc has something on both sides exactly if at least two parts of the rest of the graph touch all of a, b
    and c. Where triangles lie on both sides, all edges of such a cycle are on three; these are asked first.

    `triangles` and `opposite` (m, 3): all 3-cycles, and the edges that face their corners.
    """
    false = np.zeros(len(triangles), dtype=bool)
    for crowded in (np.all, np.any):
        count = np.bincount(opposite[~false].ravel(), minlength=len(edges))
        doubtful = np.flatnonzero(crowded(count[opposite] > 2, axis=1) & ~false)
        for some in np.array_split(doubtful, 1 + len(doubtful) // LARGE):
            false[some] = separating(n, edges, triangles[some])
    return false


def separating(n: int, edges: NDArray, cycles: NDArray) -> NDArray[np.bool_]:
    """(m,) whether at least two components of the graph without a cycle have neighbours at all of its vertices.

    Looked for in balls about all cycles at once, which grow until they tell: nearly always one of the components is
    small. What would take too long is not.
    """
    graph = adjacency(n, edges)
    separating = np.zeros(len(cycles), dtype=bool)
    left, radius = np.arange(len(cycles)), 2
    while len(left):
        parts = _parts_nearby(graph, cycles[left], radius)
        if parts is None:
            break
        separating[left] = parts > 1
        left, radius = left[parts < 0], 2 * radius
    return separating


def _parts_nearby(graph: sp.csr_array, cycles: NDArray, radius: int) -> NDArray[np.int64] | None:
    """(m,) components that touch all of a cycle, if the ball about it says; else -1. None if the balls are too large.

    Vertices are keys k n + i: every cycle k has a ball of its own.
    """
    n = graph.shape[0]
    removed = distinct(np.arange(len(cycles))[:, None] * n + cycles)
    ball = rim = removed
    tails, heads = [], []
    degree = np.diff(graph.indptr).astype(np.int64)
    for _ in range(radius):
        if degree[rim % n].sum() > 4_000_000:
            return None
        place, neighbour = neighbours(graph, rim % n)
        tail = rim[place]
        head = tail - tail % n + neighbour
        tails.append(tail)
        heads.append(head)
        reached = distinct(head)
        rim = reached[~contains(ball, reached)]
        ball = np.sort(np.concatenate([ball, rim]))
    # Components of all balls without the cycles; one that reaches the rim may go on.
    tail, head = np.concatenate(tails), np.concatenate(heads)
    kept = ~contains(removed, tail) & ~contains(removed, head)
    links = np.searchsorted(ball, np.stack([tail[kept], head[kept]]))
    count, label = connected(len(ball), *links)
    owner = np.empty(count, dtype=np.int64)
    owner[label] = ball // n
    goes_on = np.zeros(count, dtype=bool)
    goes_on[label[np.searchsorted(ball, rim)]] = True
    outside = ~contains(removed, heads[0])
    touching = distinct(label[np.searchsorted(ball, heads[0][outside])] * n + tails[0][outside] % n)
    touches_all = np.bincount(touching // n, minlength=count) == 3
    parts = np.bincount(owner[touches_all], minlength=len(cycles))
    closed = np.bincount(owner[touches_all & ~goes_on], minlength=len(cycles))
    known = (np.bincount(owner[goes_on], minlength=len(cycles)) <= 1) | (closed > 1)
    return np.where(known, parts, -1)
