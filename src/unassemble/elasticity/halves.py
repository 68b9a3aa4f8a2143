"""Nodes whose rows came apart because nothing in the pattern says that they belong together: joined by position."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .nodal import NodalMatrix, determined, without_trace
from .rows.grouping import by_first_row
from .rows.numbering import Numbering

_APART = 1e-7  # of the mean edge length, up to which two positions are one
_MOST = 0.5  # share of nodes to take apart: single rows have fewer equations, and leave more fields to look for


def joined(
    nodal: NodalMatrix, numbering: Numbering, points: NDArray[np.float64], component: NDArray[np.int64]
) -> tuple[NodalMatrix, Numbering] | None:
    """Nodes that lack directions without a trace, and lie in one place, as one node; None where there are none.

    Parameters
    ----------
    nodal : NodalMatrix
    numbering : Numbering
    points : (n, d) float64
        NaN where not determined; mean edge length 1.
    component : (n,) int64
    """
    d = nodal.dim
    present = nodal.row_of >= 0
    some = np.flatnonzero(determined(points) & ~present.all(axis=1) & present.any(axis=1))
    if not without_trace(nodal).any() or len(some) < 2:
        return None
    pairs = cKDTree(points[some]).query_pairs(_APART, output_type="ndarray")
    first, second = some[pairs[:, 0]], some[pairs[:, 1]]
    fit = ~(present[first] & present[second]).any(axis=1) & (component[first] == component[second])
    link = sp.csr_array((np.ones(fit.sum(), np.int8), (first[fit], second[fit])), shape=(nodal.n, nodal.n))
    label = sp.csgraph.connected_components(link, directed=False)[1]
    count = np.zeros((label.max() + 1, d), np.int64)
    np.add.at(count, label, present)
    fits = np.asarray((count <= 1).all(axis=1))[label]
    label = by_first_row(np.asarray(np.where(fits, label, label.max() + 1 + np.arange(nodal.n))))
    if label.max() + 1 == nodal.n:
        return None
    return _relabelled(nodal, numbering, np.repeat(label[:, None], d, axis=1))


def taken_apart(nodal: NodalMatrix, numbering: Numbering) -> tuple[NodalMatrix, Numbering] | None:
    """Rows of nodes that lack directions without a trace, and of those next to them, each a node by itself.

    Some of them belong to other nodes than they were joined to. None where no node lacks anything in this way, or so
    many do that hardly a node would be left.
    """
    odd = np.asarray(without_trace(nodal).any(axis=1))
    apart = nodal.graph @ odd.astype(float) > 0
    if not odd.any() or apart.mean() > _MOST:
        return None
    single = np.arange(nodal.n * nodal.dim).reshape(nodal.n, nodal.dim)
    return _relabelled(nodal, numbering, np.where(apart[:, None], nodal.n + single, np.arange(nodal.n)[:, None]))


def _relabelled(nodal: NodalMatrix, numbering: Numbering, label: NDArray[np.int64]) -> tuple[NodalMatrix, Numbering]:
    """The same blocks on other nodes, whose labels (n, d) are those of the unknowns."""
    node = label[numbering.node_of_row, numbering.direction_of_row]
    again = by_first_row(node)
    place = np.full(int(label.max()) + 1, -1)
    place[node] = again
    n, d = int(again.max()) + 1, nodal.dim
    old = sp.coo_array(sp.bsr_array((nodal.data, nodal.indices, nodal.indptr), shape=(nodal.n * d,) * 2))
    target = (place[label] * d + np.arange(d)).ravel()
    there = (nodal.row_of >= 0).ravel()
    kept = there[old.row] & there[old.col]
    own = np.arange(n) * d
    entries = np.concatenate([old.data[kept], np.zeros(n)])
    ends = np.concatenate([target[old.row[kept]], own]), np.concatenate([target[old.col[kept]], own])
    blocks = sp.csr_array((entries, ends), shape=(n * d, n * d)).tobsr(blocksize=(d, d))
    blocks.sort_indices()
    row_of = np.full(n * d, -1, dtype=np.int64)
    row_of[target[there]] = nodal.row_of.ravel()[there]
    penalised = np.zeros(n * d, dtype=bool)
    penalised[target[there]] = nodal.penalised.ravel()[there]
    made = NodalMatrix.of(blocks.indptr, blocks.indices, blocks.data, row_of.reshape(n, d))
    return replace(made, penalised=penalised.reshape(n, d)), replace(numbering, node_of_row=again)
