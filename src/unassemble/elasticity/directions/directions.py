"""Directions and nodes of unknowns that stand in no order.

Entries between unknowns of the same direction add up to minus the diagonal over a row, those between different
directions to little. So the right directions have the least energy: the sum of all entries between unknowns of the
same one.
"""

from __future__ import annotations

from itertools import combinations, permutations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..rows.constants import PENALTY
from ..rows.likeness import doubtful, partners, reach
from .sums import names_of, set_right

_STARTS = 8
_SETTLED = 0.05  # energy, relative to the trace, of directions that need no further start


def find_directions(
    matrix: sp.csr_array,
    group: NDArray,
    identity: NDArray,
    d: int,
    *,
    starts: int | None = None,
    ordered: bool = False,
) -> NDArray[np.int64]:
    """Direction of each row.

    Parameters
    ----------
    matrix : (N, N) sparse
    group : (N,) int64
        Rows of one group belong to one node; at most d each. Nodes may be spread over several groups.
    identity : (N,) bool
    d : int
    starts : int, optional
        Places to start from, at most.
    ordered : bool
        Whether directions increase within each group.

    Returns
    -------
    (N,) int64
        Which direction is called 0 is arbitrary unless the rows of whole nodes stand in order.
    """
    order = np.argsort(group, kind="stable")
    size = np.bincount(group)
    start = np.concatenate([[0], np.cumsum(size)[:-1]])
    members = [order[start[size == k][:, None] + np.arange(k)] for k in range(1, d + 1)]
    names = names_of(d, ordered=ordered)
    search = _Search(matrix, group, members, identity, names)
    best: tuple[float, NDArray] | None = None
    if ordered and len(members[-1]):  # whole nodes leave no choice
        starts = 1
    for known in _starts(members, len(group), d)[:starts]:
        direction = search.complete(known)
        energy = search.energy(direction)
        if best is None or energy < best[0] - 1e-9:  # equally good names of axes: the first start keeps the order
            best = (energy, direction)
        if energy < _SETTLED:
            break
    if best is None:
        return np.zeros(len(group), np.int64)
    direction = set_right(matrix, group, members, ~identity, best[1], names)
    if ordered:
        return direction
    return _named_in_order(direction, members, d)


def reconsidered(matrix: sp.csr_array, direction: NDArray[np.int64], d: int) -> NDArray[np.int64]:
    """Directions after each row, by itself, has changed its own until nothing changes."""
    order = len(direction)
    row = np.arange(order)
    return _Search(matrix, row, [row[:, None], *[np.empty((0, k), np.int64) for k in range(2, d + 1)]],
                   np.zeros(order, dtype=bool), names_of(d)).reconsider(direction)  # fmt: skip


def _named_in_order(direction: NDArray, members: list[NDArray], d: int) -> NDArray[np.int64]:
    """Exchange the names of directions so that those of whole nodes, or of all rows, increase as often as possible."""
    names = [np.array(one) for one in permutations(range(d))]
    if len(members[-1]):
        ordered = [int((name[direction[members[-1]]] == np.arange(d)).all(axis=1).sum()) for name in names]
    else:
        ordered = [int((np.diff(name[direction]) > 0).sum()) for name in names]
    return names[int(np.argmax(ordered))][direction]


def _starts(members: list[NDArray], n: int, d: int) -> list[NDArray]:
    """First all whole nodes in the order of their rows; then one node each; without any, d consecutive rows."""
    whole = members[-1]
    starts = []
    if len(whole):
        ordered = np.full(n, -1)
        ordered[whole] = np.arange(d)
        starts.append(ordered)
        seeds = whole[np.unique(np.linspace(0, len(whole) - 1, _STARTS).astype(int))]
    else:
        seeds = np.unique(np.linspace(0, n - d, _STARTS).astype(int))[:, None] + np.arange(d)
    for seed in seeds:
        one = np.full(n, -1)
        one[seed] = np.arange(d)
        starts.append(one)
    return starts


class _Search:
    """Directions that spread over the nodes, the surest first, and are then reconsidered."""

    def __init__(
        self,
        matrix: sp.csr_array,
        group: NDArray,
        members: list[NDArray],
        identity: NDArray,
        names: list[NDArray[np.int64]],
    ):
        off = matrix.tocoo()
        between = group[off.row] != group[off.col]
        sign = np.sign(matrix.diagonal().sum())
        entries = (-sign * off.data[between], (off.row[between], off.col[between]))
        self._coupling = sp.csr_array(entries, shape=matrix.shape)
        self._strength = np.asarray(abs(self._coupling).sum(axis=1)).ravel()
        diagonal = np.where(identity, 0, sign * matrix.diagonal())
        self._told = np.abs(diagonal) <= PENALTY * self._strength  # penalties would hide what all others say
        self._diagonal = float(diagonal[self._told].sum())
        self._trace = float(np.abs(diagonal[self._told]).sum()) or 1.0
        self._members, self._live, self._d = members, ~identity, len(names)
        self._choices = names

    def energy(self, direction: NDArray) -> float:
        """Sum of the entries of rows with those of the same direction, relative to the trace."""
        label = self._labels(direction)
        return (self._diagonal - float((label * (self._coupling @ label))[self._told].sum())) / self._trace

    def complete(self, direction: NDArray[np.int64]) -> NDArray[np.int64]:
        """Fill in directions of -1, then let every node reconsider until nothing changes."""
        direction = direction.copy()
        whole = self._members[-1]
        while True:
            best, margin = self._assign(direction)
            margin[direction >= 0] = 0
            if margin.max(initial=0) <= 0:
                loose: NDArray[np.int64] = np.flatnonzero(direction[whole[:, 0]] < 0)
                if not len(loose):
                    break
                direction[whole[loose[0]]] = np.arange(self._d)  # another piece: its order is ours to choose
                continue
            # A twentieth more nodes at a time: late doubts meet more labelled neighbours.
            count = max(1, int((direction >= 0).sum() // 20), int((margin > 0.5).sum()))
            take = margin >= np.partition(margin, -count)[-count]
            direction[take] = best[take]
        return self.reconsider(direction)

    def reconsider(self, direction: NDArray) -> NDArray:
        """Lower the energy node by node.

        Half of those that want to, at a time, so that neighbours do not swap for ever.
        """
        rng = np.random.default_rng(0)
        for _ in range(60):
            best, margin = self._assign(direction)
            wanting = (best != direction) & (margin > 1e-9)
            if not wanting.any():
                break
            coin = np.zeros(len(direction), dtype=bool)
            for rows in self._members:
                coin[rows] = (rng.random(len(rows)) < 0.5)[:, None]
            change = coin & (margin > 0)
            direction = np.where(change, best, direction)
        return np.where(direction < 0, 0, direction)

    def _labels(self, direction: NDArray) -> NDArray:
        known = np.flatnonzero((direction >= 0) & self._live)
        label = np.zeros((len(direction), self._d))
        label[known, direction[known]] = 1
        return label

    def _assign(self, direction: NDArray) -> tuple[NDArray, NDArray]:
        """Best directions of each row's node, and by how much they beat the second best, relative."""
        score = self._coupling @ self._labels(direction)
        best = direction.copy()
        margin = np.zeros(len(direction))
        for rows in self._members:
            if len(rows):
                choices = self._choices[rows.shape[1] - 1]
                fit = score[rows[:, None, :], choices[None]].sum(axis=2)
                two = np.partition(np.column_stack([fit, np.full(len(fit), -np.inf)]), -2, axis=1)[:, -2:]
                best[rows] = choices[np.argmax(fit, axis=1)]
                size = self._strength[rows].sum(axis=1) / self._d
                margin[rows] = ((two[:, 1] - two[:, 0]) / np.where(size > 0, size, 1))[:, None]
        return best, margin


def nodes_by_neighbours(matrix: sp.csr_array, direction: NDArray, d: int) -> NDArray[np.int64]:
    """Pair rows of different directions that couple to the same rows, although entries that vanished are not stored.

    Rows belong to one node if over two steps they reach the same rows. Both have to prefer each other to all others.
    """
    order = matrix.shape[0]
    pattern = sp.csr_array((np.ones(matrix.nnz), matrix.indices, matrix.indptr), shape=matrix.shape)
    reached = reach(matrix)
    rows = [np.flatnonzero(direction == a) for a in range(d)]
    first, second = [], []
    for c, b in combinations(range(d), 2):
        if not len(rows[c]) or not len(rows[b]):
            continue
        r, s, value = partners(pattern, reached, rows[c], rows[b])
        alone = (np.bincount(r)[r] == 1) & (np.bincount(s)[s] == 1)  # where several are alike, nothing decides
        r, s, value = r[alone], s[alone], value[alone]
        sure = value >= doubtful(value)
        first.append(rows[c][r[sure]])
        second.append(rows[b][s[sure]])
    if not first:
        return np.arange(order)
    pairs = (np.concatenate(first), np.concatenate(second))
    link = sp.csr_array((np.ones(len(pairs[0])), pairs), shape=(order, order))
    return sp.csgraph.connected_components(link, directed=False)[1].astype(np.int64)
