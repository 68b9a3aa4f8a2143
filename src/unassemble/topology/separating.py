"""3-cycles that are not faces: those with something on both sides."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..budget import LARGE
from .keys import contains, distinct
from .numbering import adjacency, neighbours

_MOST_WORK = 4_000_000  # neighbours of vertices on the rims of balls about cycles


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
        if degree[rim % n].sum() > _MOST_WORK:
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
    count, label = csgraph.connected_components(
        sp.coo_array((np.ones(links.shape[1], np.int8), links), shape=(len(ball), len(ball))), directed=False
    )
    owner = np.empty(count, dtype=np.int64)
    owner[label] = ball // n
    goes_on = np.zeros(count, dtype=bool)
    goes_on[label[np.searchsorted(ball, rim)]] = True
    outside = ~contains(removed, heads[0])
    touching = distinct(label[np.searchsorted(ball, heads[0][outside])].astype(np.int64) * n + tails[0][outside] % n)
    touches_all = np.bincount(touching // n, minlength=count) == 3
    parts = np.bincount(owner[touches_all], minlength=len(cycles))
    closed = np.bincount(owner[touches_all & ~goes_on], minlength=len(cycles))
    known = (np.bincount(owner[goes_on], minlength=len(cycles)) <= 1) | (closed > 1)
    return np.where(known, parts, -1)
