"""Directions set right by what they have to do: entries of one direction add up to zero in rows that lack nothing.

The energy by which directions are found is least for the right ones in most places, not in all. Where they are right
the sums vanish, however the entries are spread, so that nodes whose other directions let more sums vanish take these.
"""

from __future__ import annotations

from itertools import combinations, permutations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..rows.constants import ROUNDING, row_sizes, with_penalty
from .clusters import GAIN, Sums, clusters, cost, rearranged

_ROUNDS = 200
_HOPEFUL = 0.1  # share of rows that add up to zero below which nothing is to be set right


def names_of(d: int, *, ordered: bool = False) -> list[NDArray[np.int64]]:
    """(c, k) directions that k = 1 .. d rows of one node may have: all different, or increasing."""
    choose = combinations if ordered else permutations
    return [np.array(list(choose(range(d), k))) for k in range(1, d + 1)]


def set_right(
    matrix: sp.csr_array,
    group: NDArray[np.int64],
    members: list[NDArray[np.int64]],
    live: NDArray[np.bool_],
    direction: NDArray[np.int64],
    names: list[NDArray[np.int64]],
) -> NDArray[np.int64]:
    """Exchange directions, first of single nodes, then of clusters of them, as long as more sums vanish.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric.
    group : (N,) int64
        Rows of one group belong to one node.
    members : list of (m, k) int64
        Rows of the groups of k = 1 .. d rows.
    live : (N,) bool
        Rows that count.
    direction : (N,) int64
    names : list of (c, k) int64
        Directions that the rows of a group of k = 1 .. d rows may have; see :func:`names_of`.
    """
    d = len(names)
    size = row_sizes(matrix)
    scale = np.asarray(1 / np.where(size > 0, size, 1))
    telling = live & ~with_penalty(matrix, size)
    for _ in range(_ROUNDS):
        sums = _sums(matrix, direction, live, d) * scale[:, None]
        failing = (np.abs(sums).max(axis=1) > ROUNDING) & live
        if np.count_nonzero(telling & ~failing) < _HOPEFUL * np.count_nonzero(telling):
            break
        near = abs(matrix) @ failing.astype(float) > 0
        better = _each(matrix, [rows[near[rows].any(axis=1) & live[rows].all(axis=1)] for rows in members if len(rows)],
                       direction, sums, scale, names)  # fmt: skip
        if better is None:
            spoiled = np.bincount(group, telling & failing)[group] > 0  # single rows can add up to zero by symmetry
            whole = Sums(matrix, scale, sums, telling & ~spoiled)
            trials = (rearranged(whole, one, group, direction, names) for one in clusters(whole, group, live))
            better = next((one for one in trials if one is not None), None)
        if better is None:
            break
        direction = better
    return direction


def _each(
    matrix: sp.csr_array,
    members: list[NDArray],
    direction: NDArray,
    sums: NDArray,
    scale: NDArray,
    names: list[NDArray[np.int64]],
) -> NDArray[np.int64] | None:
    """Directions after those nodes have changed theirs that gain by it, and most among all near them."""
    changed = direction.copy()
    for rows in members:
        if len(rows) and (changed == direction).all():  # what one kind of nodes did changes the sums for the next
            _moved(matrix, rows, changed, sums, scale, names)
    return None if np.array_equal(changed, direction) else changed


def _sums(matrix: sp.csr_array, direction: NDArray, live: NDArray, d: int) -> NDArray[np.float64]:
    labels = np.zeros((len(direction), d))
    labels[np.flatnonzero(live), direction[live]] = 1
    return np.asarray(matrix @ labels)


def _moved(
    matrix: sp.csr_array,
    rows: NDArray,
    direction: NDArray,
    sums: NDArray,
    scale: NDArray,
    names: list[NDArray[np.int64]],
) -> None:
    """Change directions, in place, of nodes that gain most among all that share a row with them."""
    parts = [sp.csr_array(matrix[rows[:, j]]) for j in range(rows.shape[1])]
    best, choice = np.full(len(rows), GAIN), np.full(len(rows), -1)
    choices = names[rows.shape[1] - 1]
    for k, choice_k in enumerate(choices):
        gain = np.zeros(len(rows))
        for a in range(len(names)):
            step = (choice_k == a).astype(float) - (direction[rows] == a)
            change = _combined(parts, step)
            if change is None:
                continue
            node = np.repeat(np.arange(len(rows)), np.diff(change.indptr))
            before = sums[change.indices, a]
            after = before + change.data * scale[change.indices]
            gain += np.bincount(node, cost(before) - cost(after), minlength=len(rows))
        better = gain > best
        best[better], choice[better] = gain[better], k
    wanting = np.flatnonzero(choice >= 0)
    if not len(wanting):
        return
    chosen = wanting[_apart(parts, wanting, best[wanting])]
    direction[rows[chosen]] = choices[choice[chosen]]


def _combined(parts: list[sp.csr_array], step: NDArray[np.float64]) -> sp.csr_array | None:
    """Rows of the parts times the columns of `step`, added up; None where these are zero."""
    total = None
    for part, factor in zip(parts, step.T, strict=True):
        if factor.any():
            data = part.data * np.repeat(factor, np.diff(part.indptr))
            one = sp.csr_array((data, part.indices, part.indptr), shape=part.shape)
            total = one if total is None else total + one
    return total


def _apart(parts: list[sp.csr_array], wanting: NDArray, gain: NDArray) -> NDArray[np.bool_]:
    """(k,) nodes that gain more than all others with which they share a row."""
    touched = sp.csr_array(sum(abs(part[wanting]) for part in parts))
    rank = np.empty(len(gain))
    rank[np.argsort(gain, kind="stable")] = np.arange(len(gain))
    node = np.repeat(np.arange(len(wanting)), np.diff(touched.indptr))
    most = np.full(touched.shape[1], -1.0)
    np.maximum.at(most, touched.indices, rank[node])
    beaten = most[touched.indices] > rank[node]
    return np.bincount(node, beaten, minlength=len(wanting)) == 0
