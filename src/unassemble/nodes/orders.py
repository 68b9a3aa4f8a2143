"""The two usual orders of unknowns, with and without gaps.

Supports take single unknowns out, so that no stride fits the rest. Direction by direction the rows of each direction
still stand one after the other, with nodes in the same order in each; node by node directions increase in each node.
"""

from bisect import bisect_left
from itertools import permutations
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..tolerances import CANCELLED, MOST
from .constants import unaccounted
from .grouping import by_direction, joined, without_doubles

ORDERS = ("interleaved", "by component")

Pairs = tuple[NDArray[np.int64], NDArray[np.int64]]


class Reading(NamedTuple):
    """Nodes and directions of rows, and what is not sure about them, where that is known; (N,) each."""

    node: NDArray[np.int64]
    direction: NDArray[np.int64]
    open_row: NDArray[np.bool_] | None = None
    unnamed: NDArray[np.bool_] | None = None


def regular(order: int, b: int, kind: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Node and direction of each row of a matrix whose nodes have all their b unknowns, in one of the two orders."""
    row = np.arange(order)
    return (row // b, row % b) if kind == "interleaved" else (row % (order // b), row // (order // b))


def directions_by_component(
    matrix: sp.csr_array, d: int, rounding: float | NDArray[np.float64] = CANCELLED
) -> NDArray[np.int64] | None:
    """(N,) directions that increase; None where no cuts between them show.

    A row that annihilates constants direction by direction does so up to each cut: sums over its first columns vanish
    there, but for `rounding`, relative to its size. Each row votes for all places between two of its columns where they
    do; columns increase in each row.
    """
    order = matrix.shape[0]
    least = rounding * np.add.reduceat(np.abs(matrix.data), matrix.indptr[:-1])
    row = np.repeat(np.arange(order), np.diff(matrix.indptr))
    partial = _running_sums(matrix)
    inner = np.ones(matrix.nnz, dtype=bool)
    inner[matrix.indptr[1:] - 1] = False
    whole = np.abs(partial[matrix.indptr[1:] - 1]) <= least
    place = np.flatnonzero(inner & whole[row] & (np.abs(partial) <= least[row]))
    first, last = matrix.indices[place] + 1, matrix.indices[place + 1] + 1
    cuts: list[int] = []
    for _ in range(d - 1):
        votes = np.cumsum(np.bincount(first, minlength=order + 2) - np.bincount(last, minlength=order + 2))
        if votes.max() <= MOST * whole.sum():
            return None
        best = np.flatnonzero(votes == votes.max())
        run = best[: int(np.argmax(np.append(np.diff(best) > 1, True))) + 1]  # any of these
        cuts.append(int(run[0]))
        elsewhere = (last <= run[0]) | (first > run[-1])
        first, last = first[elsewhere], last[elsewhere]
    return np.searchsorted(np.sort(np.array(cuts)), np.arange(order), side="right")


def _running_sums(matrix: sp.csr_array) -> NDArray[np.float64]:
    """(nnz,) sums of each row's entries up to and including each."""
    count = np.diff(matrix.indptr)
    sums = matrix.data.copy()
    at = matrix.indptr[:-1].astype(np.int64)
    for k in range(1, int(count.max(initial=0))):  # as many steps as the longest row has entries
        here = at[count > k] + k
        sums[here] += sums[here - 1]
    return sums


def nodes_in_runs(
    matrix: sp.csr_array, group: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> NDArray[np.int64]:
    """(N,) nodes of rows that stand node by node: they end where directions stop increasing, or patterns change.

    Where patterns change only because entries that vanished are not stored, one of two runs lacks, without a trace, the
    direction of the row with which the other meets it. These go together.
    """
    node = np.concatenate([[0], np.cumsum((np.diff(group) != 0) | (np.diff(direction) <= 0))])
    while True:
        lost = unaccounted(matrix, node, direction, d)
        cut = np.diff(node) > 0
        joins = cut & (np.diff(direction) > 0)
        joins &= lost[node[:-1], direction[1:]] | lost[node[1:], direction[:-1]]
        if not joins.any():
            return node
        node = np.concatenate([[0], np.cumsum(cut & ~joins)])


def nodes_by_component(
    group: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(N,) nodes of rows that stand direction by direction: rows of one pattern, as far as the order decides.

    A direction of which a `group` has as many rows as of any other has one for each node of the group; rows of the
    other directions are paired with these. With (N,) rows that may be one node's with others of their group.
    """
    count = by_direction(group, direction, d)
    leading = (count == count.max(axis=1, keepdims=True))[group]
    first, second, alone = [], [], np.zeros(len(group), dtype=bool)
    for c, b in permutations(range(d), 2):
        rows_c, rows_b = (np.flatnonzero((direction == a) & leading[:, b]) for a in (c, b))
        r, s = _certain(group, rows_c, rows_b)
        first.append(r)
        second.append(s)
        alone[np.setdiff1d(rows_c, r)] = True
    label = joined(np.concatenate(first), np.concatenate(second), len(group))
    node, torn = without_doubles(label, direction, d)
    unsettled = np.bincount(group, alone | torn)[group] > 0
    return node, unsettled & (np.bincount(node)[node] < d)


def _certain(group: NDArray[np.int64], rows_c: NDArray[np.int64], rows_b: NDArray[np.int64]) -> Pairs:
    """Rows of two directions, both increasing, that group and order pair in one way only.

    Rows of a group are paired one after the other where there are as many in both directions. Pairs cut the order into
    pieces that hold fewer rows of each group, so that more become certain.
    """
    r, s = np.empty((2, 0), dtype=np.int64)
    while True:
        piece = np.concatenate([np.searchsorted(r, rows_c), np.searchsorted(s, rows_b)])
        label = group[np.concatenate([rows_c, rows_b])] * (len(r) + 1) + piece
        more = _in_turn(*np.split(np.unique(label, return_inverse=True)[1], [len(rows_c)]))
        if len(more[0]) <= len(r):
            return r, s
        r, s = rows_c[more[0]], rows_b[more[1]]


def _in_turn(label_c: NDArray[np.int64], label_b: NDArray[np.int64]) -> Pairs:
    """Places of rows of the same label, the first with the first, where there are as many and their pairs do not cross.

    Nodes of a group may lack one direction each, and as many of them one as the other. Then the first row of one
    direction is paired with the first of another node, and crosses most others.
    """
    many = max(label_c.max(initial=0), label_b.max(initial=0)) + 1
    equal = np.bincount(label_c, minlength=many) == np.bincount(label_b, minlength=many)
    r, s = (np.flatnonzero(equal[label]) for label in (label_c, label_b))
    r, s = r[np.argsort(label_c[r], kind="stable")], s[np.argsort(label_b[s], kind="stable")]
    order = np.argsort(r)
    r, s = r[order], s[order]
    crossing = np.ones(len(r), dtype=bool)
    crossing[_longest_increasing(s)] = False
    kept = np.bincount(label_c[r], crossing, minlength=many)[label_c[r]] == 0
    return r[kept], s[kept]


def _longest_increasing(s: NDArray[np.int64]) -> NDArray[np.int64]:
    """Places of a longest subsequence that strictly increases (patience sorting)."""
    ends: list[int] = []
    at: list[int] = []
    before: list[int] = []
    for value in s.tolist():
        k = bisect_left(ends, value)
        ends[k : k + 1], at[k : k + 1] = [value], [len(before)]
        before.append(at[k - 1] if k else -1)
    chain = at[-1:]
    while chain and before[chain[-1]] >= 0:
        chain.append(before[chain[-1]])
    return np.array(chain[::-1], dtype=np.int64)
