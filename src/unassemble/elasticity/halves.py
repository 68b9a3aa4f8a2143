"""Nodes whose rows came apart because nothing in the pattern says that they belong together: joined by position."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .grouping import by_first_row
from .nodal import NodalMatrix, determined, without_trace
from .numbering import Numbering

_APART = 1e-7  # of the mean edge length, up to which two positions are one


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
    node = label[numbering.node_of_row]
    again = by_first_row(node)
    order = np.empty(label.max() + 1, np.int64)
    order[node] = again
    return _merged(nodal, order[label]), replace(numbering, node_of_row=again)


def _merged(nodal: NodalMatrix, label: NDArray[np.int64]) -> NodalMatrix:
    """The same blocks on fewer nodes."""
    n, d = int(label.max()) + 1, nodal.dim
    shape = (n * d, n * d)
    old = sp.coo_array(sp.bsr_array((nodal.data, nodal.indices, nodal.indptr), shape=(nodal.n * d,) * 2))
    row, column = label[old.row // d] * d + old.row % d, label[old.col // d] * d + old.col % d
    blocks = sp.csr_array((old.data, (row, column)), shape=shape).tobsr(blocksize=(d, d))
    blocks.sort_indices()
    row_of = np.full((n, d), -1, dtype=np.int64)
    np.maximum.at(row_of, label, nodal.row_of)
    penalised = np.zeros((n, d), dtype=bool)
    np.logical_or.at(penalised, label, nodal.penalised)
    return replace(NodalMatrix.of(blocks.indptr, blocks.indices, blocks.data, row_of), penalised=penalised)
