"""Rows whose directions are known, but not their nodes: each is placed by itself, and those of one node coincide.

The identities hold row by row, so that a row can have a position of its own. Where several nodes couple to the same
unknowns nothing else tells which of their rows belong together.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...errors import GeometryError
from ..nodal import NodalMatrix, determined, nodal_matrix
from ..nullspace.placing import placed
from ..nullspace.planes import with_planes
from ..rows.constants import least_sums, row_sizes, with_penalty
from ..rows.grouping import by_first_row
from ..rows.numbering import Numbering
from .exchange import fullest
from .patterns import by_direction, with_patterns
from .plane_rows import of_planes

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
    *,
    ordered: bool = False,
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
    ordered : bool
        Whether the rows of each direction stand in the order of nodes.

    Returns
    -------
    node : (N,) int64
    open_row : (N,) bool
    """
    identity = ~live
    may = live if open_row is None else live & open_row
    sums = _sums(matrix, live, group, direction, d)
    countable = fullest(matrix, live, group, direction, d)[group] >= 0
    for _ in range(_ROUNDS):
        open_row = _open(group, node, direction, d) & may
        if not open_row.any():
            break
        nodal = nodal_matrix(matrix, Numbering(d, node, direction, identity, "pattern", 1.0, 1.0))
        again, settled = _joined(nodal, sums, group, node, direction, open_row, ordered=ordered)
        may = may & ~settled
        again = _remaining(group, again, direction, d, may & countable)
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


class _Sums(NamedTuple):
    """What sums over directions say of rows, whichever of them are one node's.

    Attributes
    ----------
    whole : (N, d) bool
        Rows that hold every coefficient in the columns of a direction.
    gone : (N, d) bool
        Directions that were taken out of all nodes of the row's pattern.
    surrounded : (N,) bool
        Rows whose neighbours are all there, in some direction at least.
    """

    whole: NDArray[np.bool_]
    gone: NDArray[np.bool_]
    surrounded: NDArray[np.bool_]


def _sums(
    matrix: sp.csr_array, live: NDArray[np.bool_], group: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> _Sums:
    """Rows are whole where all of their pattern annihilate constants, and nothing near is known to lack the direction.

    What was taken out leaves a trace: some row next to it does not add up to zero. Rows that touch nothing lacking some
    direction show that no node near them is missing altogether.
    """
    label = np.eye(d)[direction] * live[:, None]
    size = row_sizes(matrix)
    least = least_sums(size)
    excused = (label > 0) & with_penalty(matrix, size)[:, None]
    missing = (np.abs(matrix @ label) > least[:, None]) & ~excused
    failing = np.zeros((int(group.max()) + 1, d))
    np.add.at(failing, group, missing)
    count = by_direction(group, direction, d)
    pattern = sp.csr_array((np.ones(matrix.nnz), matrix.indices, matrix.indptr), shape=matrix.shape)
    lacking = pattern @ ((count < count.max(axis=1, keepdims=True))[group] & live[:, None]).astype(float) > 0
    adding: NDArray[np.bool_] = failing[group] == 0
    gone = (count[group] == 0) & (pattern @ missing.astype(float) > 0)
    surrounded = (adding | lacking).all(axis=1) & (adding & ~lacking).any(axis=1)
    return _Sums(adding & ~excused & ~lacking & live[:, None], gone & live[:, None], surrounded & live)


def _joined(
    nodal: NodalMatrix,
    sums: _Sums,
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    open_row: NDArray[np.bool_],
    *,
    ordered: bool,
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Nodes after those in doubt were joined that have the same pattern and lie in one place, and rows beyond doubt.

    And rows of unknown place, to the nodes that do not lie in the plane of those that lack their direction.
    """
    n, d = nodal.n, nodal.dim
    nobody = np.zeros(len(node), dtype=bool)
    valid: NDArray[np.bool_] = sums.whole[nodal.row_of] & (nodal.row_of >= 0)[:, :, None]
    try:
        solution = placed(*_equations(nodal, valid, sums, group, node, direction), None)
    except GeometryError:
        return node, nobody
    if not solution.exact or "hourglass" in solution.freedoms:
        return node, nobody
    kind = np.full(n, -1)
    kind[node[open_row]] = group[open_row]
    some = np.flatnonzero(determined(solution.points[:n]) & (kind >= 0))
    if len(some) < 2:
        return node, nobody
    pairs = some[cKDTree(solution.points[some]).query_pairs(_APART, output_type="ndarray")]
    alike = (kind[pairs[:, 0]] == kind[pairs[:, 1]]) & (np.ptp(solution.component[pairs], axis=1) == 0)
    first, second = pairs[alike].T
    link = sp.csr_array((np.ones(len(first), np.int8), (first, second)), shape=(n, n))
    count, place = sp.csgraph.connected_components(link, directed=False)
    here = place[node].astype(np.int64)
    points, gone = np.full((count, d), np.nan), np.zeros((count, d), dtype=bool)
    known = determined(solution.points[:n])
    points[place[known]] = solution.points[:n][known]
    gone[here] = sums.gone
    label, settled = of_planes(points, gone, group, here, direction, open_row, ordered=ordered)
    twice = np.asarray((by_direction(label, direction, d) > 1).any(axis=1))[label]
    return by_first_row(np.where(twice, n + node, label)), settled & ~twice


def _equations(
    nodal: NodalMatrix,
    valid: NDArray[np.bool_],
    sums: _Sums,
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
) -> tuple[NodalMatrix, NDArray[np.bool_]]:
    """Those of rows, of patterns, and of planes that rollers hold, whichever rows are one node's."""
    extended, full = with_patterns(nodal, valid, group, node, direction, sums.whole)
    row = np.zeros(nodal.n, dtype=np.int64)
    row[node] = np.arange(len(node))  # any row of the node: all have the same pattern
    completed = with_planes(nodal, valid, sums.gone[row], sums.surrounded[row])
    if completed is not None:
        extended = replace(extended, data=np.concatenate([completed[0].data, extended.data[len(nodal.data) :]]))
        full[: nodal.n] |= completed[1]
    return extended, full


def _remaining(
    group: NDArray[np.int64], node: NDArray[np.int64], direction: NDArray[np.int64], d: int, may: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """(N,) nodes after all that is left of a pattern was joined where that is one row of each direction."""
    left = (by_direction(node, direction, d) == 0).any(axis=1)[node] & may
    rest = by_direction(group[left], direction[left], d, int(group.max()) + 1)
    last = left & np.asarray((rest == 1).all(axis=1))[group]
    return by_first_row(np.where(last, len(node) + group, node))
