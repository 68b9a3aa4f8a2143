"""Planarity by the edge-addition method, through ``planarity`` where it is installed, else networkx."""

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray


def too_many(n: int, edges: NDArray) -> bool:
    """Whether there are more edges than a planar graph can have."""
    return n >= 3 and len(edges) > 3 * n - 6


def rotation_system(n: int, edges: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Half-edges tail -> head, grouped by tail, each group in its cyclic order about it in a planar embedding.

    `edges` (e, 2). Returns `tail` and `head` (2 e,), None if the graph is not planar.
    """
    if too_many(n, edges):
        return None
    with suppress(ImportError):  # no wheels for this platform: networkx has the left-right test in pure Python
        return _rotation_by_suite(n, edges)
    import networkx

    planar, embedding = networkx.check_planarity(networkx.Graph(edges.tolist()))
    if not planar:
        return None
    pairs = np.array([(v, w) for v in sorted(embedding) for w in embedding.neighbors_cw_order(v)], dtype=np.int64)
    return pairs[:, 0], pairs[:, 1]


def _rotation_by_suite(n: int, edges: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """The suite takes and gives adjacency lists as text; its vertices count from 1, and 0 ends a list."""
    import planarity

    both = np.concatenate([edges, edges[:, ::-1]])
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    degree = np.bincount(both[:, 0], minlength=n)
    start = np.cumsum(degree) - degree + 2 * np.arange(n)  # a list has its own vertex before, a zero after
    numbers = np.zeros(len(both) + 2 * n, dtype=np.int64)
    numbers[start] = np.arange(1, n + 1)
    numbers[np.arange(len(both)) + 2 * both[:, 0] + 1] = both[:, 1] + 1
    words = np.array(list(map(str, numbers.tolist())), dtype=object)
    words[start] += ":"
    graph = planarity.Graph()
    graph.gp_ReadFromString(f"N={n}\n" + " ".join(words.tolist()) + "\n")
    if graph.gp_Embed(planarity.EMBEDFLAGS_PLANAR) != planarity.OK:
        return None
    graph.gp_SortVertices()  # back from the order of its depth-first search
    text = graph.gp_WriteToString(planarity.WRITE_ADJLIST)
    lists = np.array(text.partition("\n")[2].replace(":", " ").split(), dtype=np.int64)
    end = np.flatnonzero(lists == 0)
    head = np.delete(lists, np.r_[0, end[:-1] + 1, end]) - 1
    count = np.diff(np.r_[-1, end]) - 2
    tail = np.repeat(lists[np.r_[0, end[:-1] + 1]] - 1, count)
    return tail, head
