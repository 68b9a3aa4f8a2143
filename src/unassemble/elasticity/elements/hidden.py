"""Cells whose opposite nodes share more than the cell: around irregular edges of a mesh."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .cliques import Graph

_MORE = 0.5  # of a cell's nodes, that two of them may have in common besides; 1 where two boxes share a side
_AT_ONCE = 10_000_000  # nodes in common, or pairs of them, in one go


def hidden_cliques(graph: Graph, sets: NDArray[np.int64], k: int) -> NDArray[np.int64]:
    """(m, k) further cliques of k nodes, among what is common to the pairs that no clique found has; nodes increasing.

    Where an edge of three boxes ends at another such edge, or runs along one, opposite corners of a box share nodes of
    a second box too. These do not couple to all of the first.

    Parameters
    ----------
    graph : Graph
    sets : (m, k) int64
        See :func:`.cliques.shared_cliques`.
    k : int
    """
    n = graph.n
    of = sp.csr_array(
        (np.ones(sets.size, np.int32), (sets.ravel(), np.repeat(np.arange(len(sets)), k))), (n, len(sets))
    )
    closed = graph.closed()
    inside = sp.csr_array(of @ of.T)
    inside.data[:] = 1
    outside = sp.coo_array(sp.triu(closed - closed.multiply(inside), 1))
    i, j = (ends[outside.data > 0].astype(np.int64) for ends in (outside.row, outside.col))
    degree = np.diff(closed.indptr)
    work = np.cumsum(np.minimum(degree[i], degree[j]), dtype=np.int64)
    found = [np.empty((0, k), dtype=np.int64)]
    for part in np.split(np.arange(len(i)), np.searchsorted(work, np.arange(_AT_ONCE, work[-1:].sum(), _AT_ONCE))):
        common = sp.csr_array(closed[i[part]].multiply(closed[j[part]]))
        common.sort_indices()
        count = np.diff(common.indptr)
        for size in np.unique(count[(count > k) & (count <= k * (1 + _MORE))]):
            start = common.indptr[:-1][count == size]
            sets = np.unique(common.indices[start[:, None] + np.arange(size)].astype(np.int64), axis=0)
            for some in np.array_split(sets, len(sets) * int(size) ** 2 // _AT_ONCE + 1):
                found.append(_inside(graph, some, k))
    return np.unique(np.vstack(found), axis=0)


def _inside(graph: Graph, sets: NDArray[np.int64], k: int) -> NDArray[np.int64]:
    """All largest cliques of k nodes in sets of more (m, s).

    The node that couples to fewest of a set is left out, or else all to which it does not couple.
    """
    m, s = sets.shape
    a, b = (ends.ravel() for ends in np.broadcast_arrays(sets[:, :, None], sets[:, None, :]))
    apart = ~graph.coupled(a, b).reshape(m, s, s)
    apart[:, np.arange(s), np.arange(s)] = False
    of, kept = np.arange(m), np.ones((m, s), dtype=bool)
    found = [np.empty((0, k), dtype=np.int64)]
    while len(of):
        clashes = (apart[of] & kept[:, None, :]).sum(axis=2) * kept
        done = ~clashes.any(axis=1)
        whole = done & (kept.sum(axis=1) == k)
        found.append(sets[of[whole]][kept[whole]].reshape(-1, k))
        of, kept, worst = of[~done], kept[~done], clashes[~done].argmax(axis=1)
        row = np.arange(len(of))
        without, against = kept.copy(), kept & ~apart[of, worst]
        without[row, worst] = False
        of, kept = np.concatenate([of, of]), np.vstack([without, against])
        enough = kept.sum(axis=1) >= k
        of, kept = of[enough], kept[enough]
    return np.vstack(found)
