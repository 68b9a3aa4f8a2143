"""Nodes that may lack a direction, or whose missing row may stand elsewhere: neither pattern nor order can tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .nodal import NodalMatrix, determined, without_trace
from .unknowns import Numbering


def with_doubts(nodal: NodalMatrix, numbering: Numbering) -> NodalMatrix:
    """Mark nodes whose rows may be those of two halves of one: coupled, with no direction in common.

    Where all entries are stored the halves of a node couple to the same nodes; and where unknowns stand in order, it
    tells them apart.
    """
    ordered = numbering.kind != "pattern" and numbering.common == 1 and not numbering.odd
    if numbering.kind == "given" or not numbering.incomplete or ordered:
        return nodal
    present = nodal.row_of >= 0
    some = np.asarray(present.any(axis=1) & ~present.all(axis=1))
    i, j = nodal.node, nodal.indices
    halves = some[i] & some[j] & (i != j) & ~(present[i] & present[j]).any(axis=1)
    code = _neighbourhoods(nodal)
    alike = halves & (code[i] == code[j])
    apart = np.asarray(without_trace(nodal).any(axis=1))
    apart[i[alike]] = False
    doubtful = np.zeros(nodal.n, dtype=bool)
    doubtful[i[halves if apart.any() or numbering.common < 1 else alike]] = True
    return replace(nodal, doubtful=doubtful)


def unconfirmed(nodal: NodalMatrix, points: NDArray[np.float64], cells: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) nodes with coordinates next to doubtful ones, and in no cell of those that re-assemble.

    Rows that were joined wrongly can be placed all the same; that cells re-assemble shows that theirs were not.
    """
    if nodal.doubtful is None:
        return np.zeros(nodal.n, dtype=bool)
    doubtful = nodal.doubtful | without_trace(nodal).any(axis=1)
    graph = sp.csr_array((np.ones(len(nodal.indices)), nodal.indices, nodal.indptr), shape=(nodal.n,) * 2)
    outside = determined(points) & (graph @ doubtful.astype(float) > 0)
    outside[cells.ravel()] = False
    return np.asarray(outside)


def _neighbourhoods(nodal: NodalMatrix) -> NDArray[np.uint64]:
    """(n,) equal for nodes that couple to the same nodes."""
    key = np.random.default_rng(0).integers(1, 2**62, nodal.n, dtype=np.uint64)
    graph = sp.csr_array((np.ones(len(nodal.indices), np.uint64), nodal.indices, nodal.indptr), shape=(nodal.n,) * 2)
    return np.asarray(graph @ key)  # sums wrap around, which does no harm
