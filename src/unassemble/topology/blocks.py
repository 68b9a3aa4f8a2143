"""Blocks: the largest parts of a graph that hang together without any one of their vertices."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph
from scipy.sparse.linalg import spsolve_triangular

from .adjacency import adjacency


def blocks(n: int, edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """(e,) label of the block of each edge of a connected graph; a block is called by one of its vertices.

    In a depth-first tree every edge joins a vertex with one above it. The edges below a vertex v belong to another
    block than those above if none of them leads further up than to the vertex that v hangs on (Hopcroft & Tarjan, 1973,
    Algorithm 447).

    Parameters
    ----------
    n : int
        Number of vertices.
    edges : (e, 2) int64
        Pairs i < j in lexicographic order.
    """
    order, above = csgraph.depth_first_order(adjacency(n, edges), 0)
    number = np.empty(n, dtype=np.int64)
    number[order] = np.arange(n)
    parent = np.append(0, number[above[order[1:]]])
    high, low = np.sort(number[edges], axis=1).T
    reaches = parent.copy()
    np.minimum.at(reaches, low, high)
    first = _least_below(parent, reaches) >= parent
    leader = np.where(first, np.arange(n), parent)
    while (leader[leader] != leader).any():
        leader = leader[leader]
    return np.asarray(order[leader[low]], dtype=np.int64)


def _least_below(parent: NDArray, values: NDArray) -> NDArray:
    """(n,) the least value of each vertex and those below it, which follow it in depth-first order."""
    n = len(parent)
    child = np.arange(1, n)
    ones = np.ones(n - 1)
    tree = sp.eye_array(n, format="csr") - sp.coo_array((ones, (parent[1:], child)), shape=(n, n)).tocsr()
    size = spsolve_triangular(tree, np.ones(n), lower=False, unit_diagonal=True).round().astype(np.int64)
    level = np.frexp(size)[1] - 1  # of the powers of two up to the size
    least, of_stretches = values.copy(), values
    for k in range(int(level.max()) + 1):
        start = np.flatnonzero(level == k)
        least[start] = np.minimum(of_stretches[start], of_stretches[start + size[start] - 2**k])
        of_stretches = np.minimum(of_stretches[: -(2**k)], of_stretches[2**k :])
    return least
