"""Rows whose directions are known, but not their nodes: each is placed by itself, and those of one node coincide.

The identities hold row by row, so that a row can have a position of its own. Where several nodes couple to the same
unknowns nothing else tells which of their rows belong together.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..errors import GeometryError
from .constants import least_sums, row_sizes, with_penalty
from .grouping import by_first_row
from .nodal import NodalMatrix, determined, nodal_matrix
from .numbering import Numbering
from .patterns import by_direction, with_patterns
from .placing import placed

_APART = 1e-6  # of the mean edge length, up to which two positions are one
_ROUNDS = 4


def single_nodes(group: NDArray[np.int64], direction: NDArray[np.int64], d: int) -> NDArray[np.int64]:
    """(N,) nodes of rows of the same pattern with one row of each direction at most; all other rows by themselves."""
    count = by_direction(group, direction, d)
    lone = np.asarray((count <= 1).all(axis=1))[group]
    return by_first_row(np.where(lone, group, len(group) + np.arange(len(group))))


def placed_together(
    matrix: sp.csr_array,
    live: NDArray[np.bool_],
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    d: int,
    open_row: NDArray[np.bool_] | None = None,
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Nodes after rows of the same pattern were joined whose positions coincide, and rows that are left in doubt.

    Parameters
    ----------
    matrix : (N, N) sparse
        Entries that vanish are stored.
    live : (N,) bool
        Rows that count.
    group : (N,) int64
        Rows that couple to the same unknowns.
    node, direction : (N,) int64
        Rows of one node belong together; those of others may, too.
    d : int
    open_row : (N,) bool, optional
        Rows that may belong to one node with others; all where it is not given.

    Returns
    -------
    node : (N,) int64
    open_row : (N,) bool
    """
    identity = ~live
    may = live if open_row is None else live & open_row
    whole = _whole_rows(matrix, live, group, direction, d)
    for _ in range(_ROUNDS):
        open_row = _open(group, node, direction, d) & may
        if not open_row.any():
            break
        nodal = nodal_matrix(matrix, Numbering(d, node, direction, identity, "pattern", 1.0, 1.0))
        again = _joined(nodal, whole, group, node, direction, open_row)
        again = _remaining(group, again, direction, d, may)
        if again.max() == node.max():
            break
        node = again
    return node, _open(group, node, direction, d) & may


def _open(group: NDArray[np.int64], node: NDArray[np.int64], direction: NDArray[np.int64], d: int) -> NDArray[np.bool_]:
    """(N,) rows of nodes that lack a direction which others of the same pattern, that lack some too, have."""
    absent = (by_direction(node, direction, d) == 0)[node]
    lacks = absent.any(axis=1)
    on_offer = by_direction(group[lacks], direction[lacks], d, int(group.max()) + 1) > 0
    return np.asarray((absent & on_offer[group]).any(axis=1))


def _whole_rows(
    matrix: sp.csr_array, live: NDArray[np.bool_], group: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> NDArray[np.bool_]:
    """(N, d) rows that hold every coefficient in the columns of a direction.

    All rows of the same pattern annihilate constants there, and none of what they couple to is known to lack it.
    """
    label = np.eye(d)[direction] * live[:, None]
    size = row_sizes(matrix)
    least = least_sums(size)
    excused = (label > 0) & with_penalty(matrix, size)[:, None]
    failing = np.zeros((int(group.max()) + 1, d))
    np.add.at(failing, group, (np.abs(matrix @ label) > least[:, None]) & ~excused)
    count = by_direction(group, direction, d)
    lacking = (count < count.max(axis=1, keepdims=True))[group] & live[:, None]
    pattern = sp.csr_array((np.ones(matrix.nnz), matrix.indices, matrix.indptr), shape=matrix.shape)
    return np.asarray((failing[group] == 0) & ~excused & (pattern @ lacking.astype(float) == 0) & live[:, None])


def _joined(
    nodal: NodalMatrix,
    whole: NDArray[np.bool_],
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    open_row: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """(N,) nodes after those in doubt were joined that have the same pattern and lie in one place."""
    n, d = nodal.n, nodal.dim
    valid: NDArray[np.bool_] = whole[nodal.row_of] & (nodal.row_of >= 0)[:, :, None]
    try:
        solution = placed(*with_patterns(nodal, valid, group, node, direction, whole), None)
    except GeometryError:
        return node
    if not solution.exact or "hourglass" in solution.freedoms:
        return node
    kind = np.full(n, -1)
    kind[node[open_row]] = group[open_row]
    some = np.flatnonzero(determined(solution.points[:n]) & (kind >= 0))
    if len(some) < 2:
        return node
    pairs = some[cKDTree(solution.points[some]).query_pairs(_APART, output_type="ndarray")]
    alike = (kind[pairs[:, 0]] == kind[pairs[:, 1]]) & (np.ptp(solution.component[pairs], axis=1) == 0)
    first, second = pairs[alike].T
    link = sp.csr_array((np.ones(len(first), np.int8), (first, second)), shape=(n, n))
    label = sp.csgraph.connected_components(link, directed=False)[1].astype(np.int64)[node]
    twice = np.asarray((by_direction(label, direction, d) > 1).any(axis=1))[label]
    return by_first_row(np.where(twice, n + node, label))


def _remaining(
    group: NDArray[np.int64], node: NDArray[np.int64], direction: NDArray[np.int64], d: int, may: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """(N,) nodes after all that is left of a pattern was joined where that is one row of each direction."""
    left = (by_direction(node, direction, d) == 0).any(axis=1)[node] & may
    rest = by_direction(group[left], direction[left], d, int(group.max()) + 1)
    last = left & np.asarray((rest == 1).all(axis=1))[group]
    return by_first_row(np.where(last, len(node) + group, node))
