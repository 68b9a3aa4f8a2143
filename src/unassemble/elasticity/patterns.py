"""What holds for rows that couple to the same unknowns, whichever of them belong to one node.

The rows of any direction have the same positions, those of the nodes, and so the same sum of positions. And the rows of
each direction, added up, have the boundary terms of the same nodes: to the identities they are the rows of one node.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .nodal import NodalMatrix, linked


def by_direction(label: NDArray[np.int64], direction: NDArray[np.int64], d: int, n: int = 0) -> NDArray[np.int64]:
    """(n or more, d) rows of each label and direction."""
    count = np.zeros((max(int(label.max(initial=-1)) + 1, n), d), dtype=np.int64)
    np.add.at(count, (label, direction), 1)
    return count


def with_patterns(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
) -> tuple[NodalMatrix, NDArray[np.bool_]]:
    """More equations for patterns that lack no direction, in nodes of their own, which have no positions.

    Parameters
    ----------
    nodal : NodalMatrix
        Of rows each of which may be a node by itself.
    valid : (n, d, d) bool
    group, node, direction : (N,) int64
        Pattern, node, and direction of each row.

    Returns
    -------
    nodal : NodalMatrix
    valid : (n, d, d, d) bool
    """
    count = by_direction(group, direction, nodal.dim)
    several: NDArray[np.bool_] = np.asarray((count == count[:, :1]).all(axis=1) & (count[:, 0] > 1))
    row = np.flatnonzero(several[group])
    place = (np.cumsum(several) - 1)[group[row]]
    m = int(several.sum())
    of_direction = [
        sp.csr_array((np.ones(len(some)), (place[some], node[row[some]])), shape=(m, nodal.n))
        for some in (np.flatnonzero(direction[row] == c) for c in range(nodal.dim))
    ]
    levels, levels_valid = _same_sums(nodal, valid, of_direction)
    added, added_valid = _added(nodal, valid, of_direction)
    full = np.repeat(valid[..., None], nodal.dim, axis=3)
    return _extended(nodal, [levels, added]), np.concatenate([full, levels_valid, added_valid])


def _same_sums(
    nodal: NodalMatrix, valid: NDArray[np.bool_], of_direction: list[sp.csr_array]
) -> tuple[sp.csr_array, NDArray[np.bool_]]:
    """(r d, n d) differences of mean positions, and their places: without boundary terms.

    For patterns all of whose nodes take part in some equation; `of_direction` has ones at the nodes of the rows of each
    direction, (m, n).
    """
    d = nodal.dim
    touched = np.zeros(nodal.n, dtype=bool)
    touched[nodal.indices[linked(nodal, valid)]] = True
    kept = np.flatnonzero(sum(one @ ~touched for one in of_direction) == 0)
    mean = [one[kept] / one[kept].sum(axis=1)[:, None] for one in of_direction]
    levels = sp.vstack([sp.csr_array((0, nodal.n)), *[one - mean[0] for one in mean[1:]]])
    place = np.zeros((d, d, d), dtype=bool)
    place[np.arange(d), np.arange(d), np.arange(d)] = True
    return sp.csr_array(sp.kron(levels, np.eye(d))), np.broadcast_to(place, (levels.shape[0], d, d, d))


def _added(
    nodal: NodalMatrix, valid: NDArray[np.bool_], of_direction: list[sp.csr_array]
) -> tuple[sp.csr_array, NDArray[np.bool_]]:
    """(m d, n d) rows of each pattern added up, relative to their size, and which blocks are whole."""
    n, d = nodal.n, nodal.dim
    members = sp.csr_array(sum(of_direction)).sign()
    blocks = sp.bsr_array((nodal.data, nodal.indices, nodal.indptr), shape=(n * d, n * d)).tocsr()
    weight = sp.diags_array(1 / np.maximum(members @ nodal.size, np.finfo(float).tiny)) @ members
    broken = ((nodal.row_of >= 0)[:, :, None] & ~valid).reshape(n, -1)
    whole = (members @ broken.astype(float) == 0).reshape(-1, d, d)
    return sp.csr_array(sp.kron(weight, np.eye(d)) @ blocks), np.repeat(whole[..., None], d, axis=3)


def _extended(nodal: NodalMatrix, rows: list[sp.csr_array]) -> NodalMatrix:
    """The same with nodes of size one whose rows these are, (r d, n d) each."""
    n, d = nodal.n, nodal.dim
    more = sp.vstack(rows, format="csr")
    m = more.shape[0] // d
    blocks = sp.csr_array(sp.hstack([more, sp.eye_array(m * d)])).tobsr((d, d))
    blocks.sort_indices()
    data = np.where((blocks.indices < n)[:, None, None], blocks.data, 0.0)  # every node has a block of its own
    return replace(
        nodal,
        indptr=np.concatenate([nodal.indptr, nodal.indptr[-1] + blocks.indptr[1:]]).astype(np.int32),
        indices=np.concatenate([nodal.indices, blocks.indices]).astype(np.int32),
        data=np.concatenate([nodal.data, data]),
        row_of=np.vstack([nodal.row_of, np.full((m, d), -1)]),
        size=np.concatenate([nodal.size, np.ones(m)]),
        penalised=np.vstack([nodal.penalised, np.zeros((m, d), dtype=bool)]),
    )
