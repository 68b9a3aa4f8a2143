"""Neighbours in a graph, many vertices at a time."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


def adjacency(n: int, edges: NDArray) -> sp.csr_array:
    """(n, n) pattern with both triangles."""
    ends = np.concatenate([edges, edges[:, ::-1]]).astype(np.int32)
    return sp.coo_array((np.ones(len(ends), np.int8), ends.T), shape=(n, n)).tocsr()


def neighbours(graph: sp.csr_array, vertices: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """All neighbours of some vertices.

    Returns `place` (k,): which of `vertices`, in increasing order; `neighbour` (k,).
    """
    count = graph.indptr[vertices + 1] - graph.indptr[vertices]
    place = np.repeat(np.arange(len(vertices)), count)
    within = np.arange(len(place)) - np.repeat(np.cumsum(count) - count, count)
    return place, graph.indices[graph.indptr[vertices[place]] + within].astype(np.int64)
