"""Breadth-first search over all connected components of a graph."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph


def breadth_first(graph: sp.csr_array) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Search each component from its lowest vertex.

    Parameters
    ----------
    graph : (n, n) csr_array
        Both triangles of a symmetric pattern; entries do not count.

    Returns
    -------
    order : (n,) int32
        Vertices in the order in which they are reached.
    parent : (n,) int32
        -1 at the start of each component.
    """
    n = graph.shape[0]
    order, parent = csgraph.breadth_first_order(graph, 0, directed=True)
    if len(order) == n:
        return order, np.maximum(parent, -1)
    # One search from an extra node that is joined to every component, however many there are.
    n_components, component = csgraph.connected_components(graph, directed=False)
    first = np.full(n_components, n)
    np.minimum.at(first, component, np.arange(n))
    indptr = np.append(graph.indptr, graph.indptr[-1] + n_components)
    joined = sp.csr_array(
        (np.ones(indptr[-1], np.int8), np.append(graph.indices, first.astype(graph.indices.dtype)), indptr),
        shape=(n + 1, n + 1),
    )
    order, parent = csgraph.breadth_first_order(joined, n, directed=True)
    parent = parent[:n]
    return order[1:], np.where(parent == n, -1, parent)
