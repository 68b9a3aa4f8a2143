"""What holds for rows that couple to the same unknowns, whichever of them belong to one node.

The rows of any direction have the same positions, those of the nodes, and so the same sum of positions. And the rows of
each direction, added up, have the boundary terms of the same nodes: to the identities they are the rows of one node.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodal import NodalMatrix, linked


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
    whole: NDArray[np.bool_],
) -> tuple[NodalMatrix, NDArray[np.bool_]]:
    """More equations for patterns of several nodes, which stand in nodes of their own, without positions.

    They are for directions of which each of the nodes has a row: those with most rows, if columns of one of them are
    whole in all rows of the pattern, which are themselves among these columns.

    Parameters
    ----------
    nodal : NodalMatrix
        Of rows each of which may be a node by itself.
    valid : (n, d, d) bool
    group, node, direction : (N,) int64
        Pattern, node, and direction of each row.
    whole : (N, d) bool
        Rows that hold every coefficient in the columns of a direction.

    Returns
    -------
    nodal : NodalMatrix
    valid : (n, d, d, d) bool
    """
    d = nodal.dim
    count = by_direction(group, direction, d)
    full: NDArray[np.bool_] = np.asarray((count == count.max(axis=1, keepdims=True)) & (count > 1))
    broken = np.zeros(count.shape)
    excused = nodal.penalised[node, direction][:, None] & (direction[:, None] == np.arange(d))
    np.add.at(broken, group, ~whole & ~excused)
    full &= (full & (broken == 0)).any(axis=1, keepdims=True)
    several = np.asarray(full.sum(axis=1) > 1)
    place, m = np.cumsum(several) - 1, int(several.sum())
    of_direction = []
    for c in range(d):
        row = np.flatnonzero((direction == c) & (several & full[:, c])[group])
        of_direction.append(sp.csr_array((np.ones(len(row)), (place[group[row]], node[row])), shape=(m, nodal.n)))
    levels, levels_valid = _same_sums(nodal, valid, of_direction, full[several])
    added, added_valid = _added(nodal, valid, of_direction, full[several])
    every = np.repeat(valid[..., None], d, axis=3)
    return _extended(nodal, [levels, added]), np.concatenate([every, levels_valid, added_valid])


def _same_sums(
    nodal: NodalMatrix, valid: NDArray[np.bool_], of_direction: list[sp.csr_array], full: NDArray[np.bool_]
) -> tuple[sp.csr_array, NDArray[np.bool_]]:
    """(r d, n d) differences of mean positions, and their places: without boundary terms.

    For patterns all of whose rows take part in some equation.

    Parameters
    ----------
    nodal : NodalMatrix
    valid : (n, d, d) bool
    of_direction : list of (m, n) sparse
        Ones at the nodes of the rows of each direction, by pattern.
    full : (m, d) bool
        Directions that count.
    """
    d = nodal.dim
    touched = np.zeros(nodal.n, dtype=bool)
    touched[nodal.indices[linked(nodal, valid)]] = True
    mean = [sp.diags_array(1 / np.maximum(one.sum(axis=1), 1)) @ one for one in of_direction]
    first, kept = full.argmax(axis=1), sum(one @ ~touched for one in of_direction) == 0
    level = [sp.csr_array((0, nodal.n))]
    for b, c in combinations(range(d), 2):
        some = np.flatnonzero(kept & (first == b) & full[:, c])
        level.append(mean[c][some] - mean[b][some])
    rows = sp.csr_array(sp.vstack(level))
    place = np.zeros((d, d, d), dtype=bool)
    place[np.arange(d), np.arange(d), np.arange(d)] = True
    return sp.csr_array(sp.kron(rows, np.eye(d))), np.broadcast_to(place, (rows.shape[0], d, d, d))


def _added(
    nodal: NodalMatrix, valid: NDArray[np.bool_], of_direction: list[sp.csr_array], full: NDArray[np.bool_]
) -> tuple[sp.csr_array, NDArray[np.bool_]]:
    """(m d, n d) rows of each pattern added up, relative to their size, and which blocks are whole."""
    n, d = nodal.n, nodal.dim
    members = sp.csr_array(sum(of_direction)).sign()
    blocks = sp.bsr_array((nodal.data, nodal.indices, nodal.indptr), shape=(n * d, n * d)).tocsr()
    weight = sp.diags_array(1 / np.maximum(members @ nodal.size, np.finfo(float).tiny)) @ members
    broken = ((nodal.row_of >= 0)[:, :, None] & ~valid).reshape(n, -1)
    sound = full[:, :, None] & (members @ broken.astype(float) == 0).reshape(-1, d, d)
    return sp.csr_array(sp.kron(weight, np.eye(d)) @ blocks), np.repeat(sound[..., None], d, axis=3)


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
