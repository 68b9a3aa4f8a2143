"""Sets of integers as sorted arrays, the keys of pairs of vertices, and rows grouped by label."""

import numpy as np
from numpy.typing import NDArray


def distinct(values: NDArray) -> NDArray[np.int64]:
    """Sorted, each value once.

    numpy.unique hashes first, which takes several times as long for the integers that occur here.
    """
    values = np.sort(values, axis=None)
    if not len(values):
        return values
    return values[np.append(True, values[1:] != values[:-1])]


def contains(values: NDArray, wanted: NDArray) -> NDArray[np.bool_]:
    """Whether each of `wanted` is among the sorted `values`."""
    return found(values, wanted)[1]


def found(values: NDArray, wanted: NDArray) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """The place of each of `wanted` in the sorted `values`, and whether it is there; if not the place is any."""
    if not len(values):
        return np.zeros(np.shape(wanted), dtype=np.int64), np.zeros(np.shape(wanted), dtype=bool)
    place = np.minimum(np.searchsorted(values, wanted), len(values) - 1)
    return place, values[place] == wanted


def runs(count: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Of consecutive groups of so many rows each (groups,): the group of each row, and its place there."""
    group = np.repeat(np.arange(len(count)), count)
    return group, np.arange(len(group)) - (np.cumsum(count) - count)[group]


def pair_keys(n: int, a: NDArray, b: NDArray) -> NDArray[np.int64]:
    """i n + j for each pair {a, b} = {i, j} of vertices, i < j: sorted like edges in lexicographic order."""
    return np.minimum(a, b) * n + np.maximum(a, b)


def with_sides(n: int, edges: NDArray, triangles: NDArray) -> tuple[NDArray[np.int64], NDArray, NDArray]:
    """Edges of a graph, (e, 2), pairs i < j in lexicographic order, and of triangles (m, 3) together.

    Returns `edges` (e', 2) in the same order; `given` (e,): rows of the given ones; `opposite` (m, 3): rows of those
    that face the corners.
    """
    known = edges[:, 0] * n + edges[:, 1]
    sides = pair_keys(n, triangles[:, [1, 2, 0]], triangles[:, [2, 0, 1]])
    keys = distinct(np.concatenate([known, sides.ravel()]))
    return np.column_stack([keys // n, keys % n]), np.searchsorted(keys, known), np.searchsorted(keys, sides)


def first_rows(label: NDArray, n_labels: int) -> NDArray[np.int64]:
    """(labels,) the first row with each label; every label has one."""
    first = np.empty(n_labels, dtype=np.int64)
    first[label[::-1]] = np.arange(len(label))[::-1]  # of several the last that is written stays
    return first


class Grouped:
    """Rows sorted by label; negative labels are left out."""

    order: NDArray[np.int64]  # (k,) rows with label 0, 1, ..., each in increasing order
    start: NDArray[np.int64]  # (labels + 1,) those with label j are ``order[start[j]:start[j + 1]]``
    rank: NDArray[np.int64]  # (rows,) place of each among those with the same label

    def __init__(self, label: NDArray, n_labels: int):
        order = np.argsort(label, kind="stable")
        start = np.searchsorted(label[order], np.arange(n_labels + 1))
        self.order = order[start[0] :]
        self.start = start - start[0]
        self.rank = np.full(len(label), -1)
        self.rank[self.order] = np.arange(len(self.order)) - self.start[label[self.order]]
