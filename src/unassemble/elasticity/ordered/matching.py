"""Rows of one node in matrices whose unknowns stand direction by direction, with nodes in the same order in each.

Two rows of one node are found by what they couple to, and by the order: pairs of rows must not cross. Where entries
that vanished are stored, rows of one node have the same pattern; otherwise they are only alike.
"""

from __future__ import annotations

from bisect import bisect_left
from itertools import combinations, permutations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..rows.grouping import without_doubles
from ..rows.likeness import compared, doubtful, reach
from .alignment import aligned

_STEPS = 4  # of the graph, over which rows are compared

Pairs = tuple[NDArray[np.int64], NDArray[np.int64]]


def matched_by_pattern(
    group: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Nodes of rows whose directions are known: rows of the same pattern, as far as the order decides.

    A direction of which a group has as many rows as of any other has one for each node of the group; rows of the other
    directions are paired with these.

    Parameters
    ----------
    group : (N,) int64
        Rows that couple to the same unknowns; several nodes may do so.
    direction : (N,) int64
    d : int

    Returns
    -------
    node : (N,) int64
    open_row : (N,) bool
        Rows that may belong to one node with others of their group.
    """
    count = np.zeros((int(group.max()) + 1, d), dtype=np.int64)
    np.add.at(count, (group, direction), 1)
    leading = (count == count.max(axis=1, keepdims=True))[group]
    pairs, alone = [], np.zeros(len(group), dtype=bool)
    for c, b in permutations(range(d), 2):
        rows = [np.flatnonzero((direction == a) & leading[:, b]) for a in (c, b)]
        pairs.append(_certain(group, *rows))
        alone[np.setdiff1d(rows[0], pairs[-1][0])] = True
    node, torn = _joined(pairs, direction, d)
    unsettled = np.bincount(group, alone | torn)[group] > 0
    return node, unsettled & (np.bincount(node)[node] < d)


def _certain(group: NDArray, rows_c: NDArray, rows_b: NDArray) -> Pairs:
    """Rows of two directions, both increasing, that group and order pair in one way only.

    Rows of a group are paired one after the other where there are as many in both directions. Pairs cut the order into
    pieces that hold fewer rows of each group, so that more become certain.
    """
    r, s = np.empty((2, 0), dtype=np.int64)
    while True:
        piece = np.concatenate([np.searchsorted(r, rows_c), np.searchsorted(s, rows_b)])
        label = group[np.concatenate([rows_c, rows_b])] * (len(r) + 1) + piece
        label_c, label_b = np.split(np.unique(label, return_inverse=True)[1], [len(rows_c)])
        more = _uncrossed(*_in_turn(label_c, label_b))
        if len(more[0]) <= len(r):
            return r, s
        r, s = rows_c[more[0]], rows_b[more[1]]


def _in_turn(label_c: NDArray, label_b: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Places of rows of the same label, the first with the first, where there are as many; and their label."""
    many = max(label_c.max(initial=0), label_b.max(initial=0)) + 1
    equal = np.bincount(label_c, minlength=many) == np.bincount(label_b, minlength=many)
    r, s = (np.flatnonzero(equal[label]) for label in (label_c, label_b))
    r, s = r[np.argsort(label_c[r], kind="stable")], s[np.argsort(label_b[s], kind="stable")]
    order = np.argsort(r)
    return r[order], s[order], label_c[r[order]]


def _uncrossed(r: NDArray, s: NDArray, label: NDArray) -> Pairs:
    """Pairs of labels none of whose pairs crosses those of most others.

    Nodes of a group may lack one direction each, and as many of them one as the other. Then the first row of one
    direction is paired with the first of another node.
    """
    kept = np.zeros(len(r), dtype=bool)
    kept[longest_increasing(r, s)] = True
    wrong = np.bincount(label, ~kept, minlength=label.max(initial=0) + 1) > 0
    kept &= ~wrong[label]
    return r[kept], s[kept]


def matched_by_likeness(matrix: sp.csr_array, direction: NDArray[np.int64], d: int) -> NDArray[np.int64]:
    """The same where entries that vanished are not stored, from what rows reach over some steps of the graph."""
    reached = reach(matrix, _STEPS)
    pattern = sp.csr_array((np.ones(matrix.nnz, np.float32), matrix.indices, matrix.indptr), shape=matrix.shape)
    rows = [np.flatnonzero(direction == a) for a in range(d)]
    pairs = [
        _paired(pattern, reached, rows[c], rows[b])
        for c, b in combinations(range(d), 2)
        if len(rows[c]) and len(rows[b])
    ]
    return _joined(pairs, direction, d)[0]


def _joined(pairs: list[Pairs], direction: NDArray[np.int64], d: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(N,) nodes made up of paired rows, and which rows contradict.

    Chains of pairs with two rows of a direction come apart.
    """
    order = len(direction)
    none = np.empty(0, np.int64)
    first, second = (np.concatenate([none, *some]) for some in zip((none, none), *pairs, strict=True))
    link = sp.csr_array((np.ones(len(first), np.int8), (first, second)), shape=(order, order))
    label = sp.csgraph.connected_components(link, directed=False)[1].astype(np.int64)
    return without_doubles(label, np.arange(order), direction, d)


def _paired(pattern: sp.csr_array, reached: sp.csr_array, rows_c: NDArray, rows_b: NDArray) -> Pairs:
    """Rows of two directions, both increasing, that are alike, in increasing order."""
    r, s, value = compared(pattern, reached, rows_c, rows_b)
    chosen = aligned(r, s, value)
    r, s, value = r[chosen], s[chosen], value[chosen]
    sure = value >= doubtful(value)
    return rows_c[r[sure]], rows_b[s[sure]]


def longest_increasing(r: NDArray[np.int64], s: NDArray[np.int64]) -> NDArray[np.int64]:
    """Places of a longest subset of pairs with both r and s strictly increasing (patience sorting)."""
    order = np.lexsort((-s, r))  # of several partners of one row at most one is taken
    ends: list[int] = []
    at: list[int] = []
    before = np.full(len(r), -1)
    for place in order.tolist():
        k = bisect_left(ends, int(s[place]))
        if k == len(ends):
            ends.append(int(s[place]))
            at.append(place)
        else:
            ends[k], at[k] = int(s[place]), place
        before[place] = at[k - 1] if k else -1
    chain = []
    place = at[-1] if at else -1
    while place >= 0:
        chain.append(place)
        place = int(before[place])
    return np.array(chain[::-1], dtype=np.int64)
