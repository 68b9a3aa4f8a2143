"""Bars of a truss: the block of two nodes is that of one bar, and tells its direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import SAMPLE
from ..nodes.constants import uncoupled_rows
from ..nodes.nodal import NodalMatrix, nodal_matrix
from ..nodes.numbering import Numbering
from ..nodes.orders import ORDERS, regular
from ..tolerances import CANCELLED


@dataclass(frozen=True, eq=False)
class Bars:
    """Bars of a truss, and their directions.

    Attributes
    ----------
    ends : (m, 2) int64
        Nodes of each bar, the lesser first.
    directions : (m, d) float64
        Unit vectors, sign arbitrary.
    known : (m,) bool
        False for bars both of whose ends lack unknowns, so that only a part of the direction shows.
    whole : (m,) bool
        False for bars one of whose ends lacks unknowns.
    """

    ends: NDArray[np.int64]
    directions: NDArray[np.float64]
    known: NDArray[np.bool_]
    whole: NDArray[np.bool_]


def bars_of(nodal: NodalMatrix, allowed: float = CANCELLED) -> Bars | None:
    """The bars, if every pair of coupled nodes is one, and they span space; None for other matrices.

    Parameters
    ----------
    nodal : NodalMatrix
    allowed : float
        What may be left of a block beside a bar, relative to its size.
    """
    upper = (nodal.node < nodal.indices) & (np.abs(nodal.data).max(axis=(1, 2)) > 0)
    blocks = nodal.data[upper]
    if not len(blocks):
        return None
    some = np.linalg.svd(blocks[:SAMPLE], compute_uv=False)
    if (some[:, 1] > allowed * some[:, 0]).any():  # mostly a solid: not worth looking at all of it
        return None
    i, j = nodal.node[upper].astype(np.int64), nodal.indices[upper].astype(np.int64)
    left, size, right = np.linalg.svd(blocks)
    if (size[:, 1] > allowed * size[:, 0]).any():
        return None
    whole = nodal.row_of.min(axis=1) >= 0
    # Rows belong to i, columns to j: whichever has all its unknowns shows all of the direction.
    directions = np.where(whole[j][:, None], right[:, 0], left[:, :, 0])
    known = whole[i] | whole[j]
    both = whole[i] & whole[j]
    aligned = (left[both, :, 0] * right[both, 0]).sum(axis=1)
    if not both.any() or np.abs(np.abs(aligned) - 1).max() > allowed:
        return None
    spread = np.linalg.eigvalsh(directions[known].T @ directions[known] / known.sum())
    pulls = np.trace(blocks[both], axis1=1, axis2=2) > 0
    if spread[0] < CANCELLED or 0 < pulls.sum() < len(pulls):  # bars all in line or in a plane; of stiffness below zero
        return None
    return Bars(np.column_stack([i, j]), directions, known, both)


def truss_numbering(
    matrix: sp.csr_array, block_size: int | None = None, kind: str | None = None, allowed: float = CANCELLED
) -> Numbering | None:
    """The usual numbering in which all blocks are those of bars, however many supports there are; None if none is.

    Parameters
    ----------
    matrix : (N, N) sparse
    block_size : {2, 3}, optional
    kind : {None, "interleaved", "by component"}
    allowed : float
        See :func:`bars_of`.
    """
    order = matrix.shape[0]
    for d in (3, 2) if block_size is None else (block_size,):
        if order % d or order < 2 * d:
            continue
        for name in ORDERS if kind is None else (kind,):
            node, direction = regular(order, d, name)
            numbering = Numbering(d, node, direction, uncoupled_rows(matrix), name, 0.0, 1.0)
            if bars_of(nodal_matrix(matrix, numbering), allowed) is not None:
                return numbering
    return None
