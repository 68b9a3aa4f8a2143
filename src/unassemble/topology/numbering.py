"""Vertices renumbered so that neighbours have nearby numbers, by breadth-first search."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from .keys import Grouped, first_rows, runs


@dataclass(frozen=True, eq=False)
class LocalNumbering:
    """A graph whose vertices have numbers of its own."""

    vertices: NDArray[np.int64]  # (k,) vertex of the original graph behind each number
    edge_rows: NDArray[np.int64]  # (e,) row of the original edge list behind each edge
    edges: NDArray[np.int64]  # (e, 2) new numbers i < j in lexicographic order


def local_numbering(n: int, edges: NDArray) -> LocalNumbering:
    """Number vertices in breadth-first order.

    The rows of a matrix may lie in any order, and on large meshes most of the time would go into waiting for memory:
    after this, what lies near each other on the mesh does so in memory. `edges` (e, 2) as in `LocalNumbering`.
    """
    upper = sp.coo_array((np.ones(len(edges), np.int8), edges.astype(np.int32).T), shape=(n, n)).tocsr()
    vertices, _ = breadth_first(upper + upper.T)
    number = np.empty(n, dtype=np.int32)
    number[vertices] = np.arange(n, dtype=np.int32)
    a, b = number[edges[:, 0]], number[edges[:, 1]]
    low, high = np.minimum(a, b), np.maximum(a, b)
    # Compression to columns sorts by the lower end, then the higher one, and takes the row numbers along.
    by_low = sp.coo_array((np.arange(len(edges), dtype=np.int32), (high, low)), shape=(n, n)).tocsc()
    low = np.repeat(np.arange(n), np.diff(by_low.indptr))
    return LocalNumbering(
        vertices.astype(np.int64), by_low.data.astype(np.int64), np.column_stack([low, by_low.indices])
    )


def components(n: int, edges: NDArray) -> list[LocalNumbering]:
    """Connected components with edges, (e, 2), each in a numbering of its own, largest first."""
    count, label = connected(n, *edges.T)
    used = np.zeros(n, dtype=bool)
    used[edges] = True
    vertices, rows = Grouped(np.where(used, label, -1), count), Grouped(label[edges[:, 0]], count)
    local = vertices.rank[edges[rows.order]]
    size = np.diff(rows.start)
    order = np.argsort(-size, kind="stable")[: np.count_nonzero(size)]
    v, e = vertices.start.tolist(), rows.start.tolist()
    return [
        LocalNumbering(vertices.order[v[k] : v[k + 1]], rows.order[e[k] : e[k + 1]], local[e[k] : e[k + 1]])
        for k in order.tolist()
    ]


def connected(n: int, one: NDArray, other: NDArray) -> tuple[int, NDArray[np.int64]]:
    """Number of connected components of a graph with edges between `one` and `other`, (e,) each; and that of each row.

    Isolated vertices count; components are numbered in order of their lowest vertices.
    """
    graph = sp.coo_array((np.ones(len(one), np.int8), (one, other)), shape=(n, n))
    count, label = csgraph.connected_components(graph, directed=False)
    return int(count), label.astype(np.int64)


def breadth_first(graph: sp.csr_array, component: NDArray | None = None) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Search each component of a symmetric pattern (n, n), or of one of directed cycles, from its lowest vertex.

    `component` (n,): of each vertex, where it is known. Returns `order` (n,): vertices in the order in which they are
    reached; `parent` (n,): -1 at the start of each component.
    """
    n = graph.shape[0]
    order, parent = csgraph.breadth_first_order(graph, 0, directed=True)
    if len(order) == n:
        return order, np.maximum(parent, -1)
    # One search from an extra node that is joined to every component, however many there are.
    if component is None:
        component = csgraph.connected_components(graph, directed=False)[1]
    first = first_rows(component, int(component.max()) + 1)
    indptr = np.append(graph.indptr, graph.indptr[-1] + len(first))
    joined = sp.csr_array(
        (np.ones(indptr[-1], np.int8), np.append(graph.indices, first.astype(graph.indices.dtype)), indptr),
        shape=(n + 1, n + 1),
    )
    order, parent = csgraph.breadth_first_order(joined, n, directed=True)
    parent = parent[:n]
    return order[1:], np.where(parent == n, -1, parent)


def adjacency(n: int, edges: NDArray) -> sp.csr_array:
    """(n, n) pattern with both triangles."""
    ends = np.concatenate([edges, edges[:, ::-1]]).astype(np.int32)
    return sp.coo_array((np.ones(len(ends), np.int8), ends.T), shape=(n, n)).tocsr()


def neighbours(graph: sp.csr_array, vertices: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """All neighbours of some vertices.

    Returns `place` (k,): which of `vertices`, in increasing order; `neighbour` (k,).
    """
    place, within = runs(graph.indptr[vertices + 1] - graph.indptr[vertices])
    return place, graph.indices[graph.indptr[vertices[place]] + within].astype(np.int64)
