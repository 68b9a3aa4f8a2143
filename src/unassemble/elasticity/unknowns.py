"""Which rows of a matrix belong to one node, and to which direction each of them.

Two kinds of evidence decide. Constants: in the right numbering the columns of one direction add up to zero in
the rows of interior nodes. And the pattern: the unknowns of a node couple to the same unknowns.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import InputError, RecoveryError

_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Numbering:
    """Nodes and directions of the rows of a vector-valued matrix.

    Attributes
    ----------
    block_size : int
        Unknowns per node, 2 or 3.
    node_of_row : (N,) int64
        Nodes are numbered by their first row.
    direction_of_row : (N,) int64
    identity_row : (N,) bool
        Rows that couple to nothing: unknowns replaced by the identity.
    kind : {"interleaved", "by component", "pattern"}
    share : float
        Share of the pairs (row, direction) whose entries add up to zero, among rows that couple.
    """

    block_size: int
    node_of_row: NDArray[np.int64]
    direction_of_row: NDArray[np.int64]
    identity_row: NDArray[np.bool_]
    kind: str
    share: float

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return int(self.node_of_row.max()) + 1


def find_numbering(matrix: sp.csr_array, block_size: int | None = None) -> Numbering:
    """Recognise nodes and directions.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric.
    block_size : int, optional
        2 or 3, where it is known.

    Raises
    ------
    InputError
        If the block size is neither 2 nor 3.
    RecoveryError
        If no numbering makes rows annihilate constants.
    """
    if block_size not in (None, 2, 3):
        raise InputError(f"the block size is {block_size}; elasticity has 2 or 3 unknowns per node")
    sizes = (block_size,) if block_size else (3, 2)
    identity = _uncoupled_rows(matrix)
    found = []
    for d in sizes:
        found += [_regular(matrix, identity, d, kind) for kind in ("interleaved", "by component")]
    best = max((one for one in found if one is not None), key=lambda one: one.share, default=None)
    if best is None or best.share < 0.5:
        tried = [_from_pattern(matrix, identity, d) for d in sizes]
        candidates = [one for one in [best, *tried] if one is not None]
        best = max(candidates, key=lambda one: one.share, default=None)
    if best is None or best.share <= 0:
        raise RecoveryError(
            "no numbering with 2 or 3 unknowns per node makes the rows annihilate translations: this is no "
            "elasticity matrix, or its unknowns are scaled one by one"
        )
    return best


def _uncoupled_rows(matrix: sp.csr_array) -> NDArray[np.bool_]:
    off = matrix.copy()
    off.setdiag(0)
    return np.asarray(abs(off).sum(axis=1)).ravel() == 0


def _regular(matrix: sp.csr_array, identity: NDArray, d: int, kind: str) -> Numbering | None:
    """One of the two numberings that need no search, if the order allows it."""
    order = matrix.shape[0]
    if order % d:
        return None
    row = np.arange(order)
    node, direction = (row // d, row % d) if kind == "interleaved" else (row % (order // d), row // (order // d))
    if _common(matrix, node, direction) < 0.6:
        return None
    return Numbering(d, node, direction, identity, kind, _share(matrix, identity, direction, d))


def _common(matrix: sp.csr_array, node: NDArray, direction: NDArray) -> float:
    """How far the rows of one node couple to the same nodes: 1 if all do, about 1 / d if their nodes are made up."""
    n, d = node.max() + 1, direction.max() + 1
    onto = sp.csr_array((np.ones(len(node), np.int32), (np.arange(len(node)), node)), shape=(len(node), n))
    pattern = sp.csr_array((np.ones(matrix.nnz, np.int32), matrix.indices, matrix.indptr), shape=matrix.shape)
    rows = pattern @ onto
    return rows.nnz / (d * (onto.T.tocsr() @ rows).nnz)


def _share(matrix: sp.csr_array, identity: NDArray, direction: NDArray, d: int) -> float:
    """Share of pairs (row, direction) that annihilate constants. Rows that annihilate all at once count only."""
    live = ~identity
    if not live.any():
        return 0.0
    ones = np.zeros((len(direction), d))
    ones[np.flatnonzero(live), direction[live]] = 1
    off = abs(matrix).sum(axis=1) - np.abs(matrix.diagonal())
    size = np.asarray(off).ravel()[live]
    zero = np.abs(matrix @ ones)[live] <= _ROUNDING * size[:, None]
    own = zero[np.arange(len(size)), direction[live]]
    return float((zero & own[:, None]).mean())


def _from_pattern(matrix: sp.csr_array, identity: NDArray, d: int) -> Numbering | None:
    """Nodes are rows of the same pattern; directions follow from how rows couple to labelled neighbours."""
    group = _same_pattern(matrix, identity)
    size = np.bincount(group)
    if size.max() > d:
        group = _split(group, d)
        size = np.bincount(group)
    if size.max() > d or (size == d).mean() < 0.2:
        return None
    direction = _directions(matrix, group, identity, d)
    if direction is None:
        return None
    return Numbering(d, group, direction, identity, "pattern", _share(matrix, identity, direction, d))


def _same_pattern(matrix: sp.csr_array, identity: NDArray) -> NDArray[np.int64]:
    """(N,) group of each row, numbered by first row: rows whose stored entries stand in the same columns."""
    order = matrix.shape[0]
    key = np.random.default_rng(0).integers(1, 2**62, order, dtype=np.uint64)
    pattern = sp.csr_array((np.ones(matrix.nnz, np.uint64), matrix.indices, matrix.indptr), shape=matrix.shape)
    code = pattern @ key  # sums wrap around, which does no harm
    code[identity] = key[identity]
    return _by_first_row(np.unique(code, return_inverse=True)[1])


def _by_first_row(label: NDArray) -> NDArray[np.int64]:
    """Renumber labels by the first row that carries them."""
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[inverse]


def _split(group: NDArray[np.int64], d: int) -> NDArray[np.int64]:
    """Nodes of the same closed neighbourhood: take runs of consecutive rows, or else every k-th of a group."""
    order = np.argsort(group, kind="stable")
    start = np.searchsorted(group[order], np.arange(group.max() + 1))
    size = np.bincount(group)
    position = np.arange(len(group)) - np.repeat(start, size)
    jump = np.diff(order, prepend=-2) != 1
    jump[start] = True
    run = np.cumsum(jump) - 1
    place = np.arange(len(group)) - np.flatnonzero(jump)[run]
    in_runs = bool((np.bincount(run) % d == 0).mean() > 0.5)
    per_group = np.maximum(np.repeat(size // d, size), 1)
    big = np.repeat(size > d, size)
    part = (run * len(group) + place // d) if in_runs else position % per_group
    label = np.where(big, group[order] * (len(group) ** 2) + part + 1, group[order] * (len(group) ** 2))
    split = np.empty_like(group)
    split[order] = label
    return _by_first_row(split)


def _directions(matrix: sp.csr_array, group: NDArray, identity: NDArray, d: int) -> NDArray[np.int64]:
    """Directions of all rows: the order of the rows within whole nodes where that works, else a search."""
    order = np.argsort(group, kind="stable")
    size = np.bincount(group)
    start = np.concatenate([[0], np.cumsum(size)[:-1]])
    members = [order[start[size == k][:, None] + np.arange(k)] for k in range(1, d + 1)]
    ordered = np.full(len(group), -1)
    ordered[members[-1]] = np.arange(d)
    search = _DirectionSearch(matrix, group, members, identity, d)
    direction = search.complete(ordered)
    if _share(matrix, identity, direction, d) < 0.3:
        other = search.complete(np.full(len(group), -1))
        direction = max(direction, other, key=lambda one: _share(matrix, identity, one, d))
    return direction


class _DirectionSearch:
    """Directions that spread over the nodes, the surest first.

    Entries between the same directions add up to minus the diagonal over a row, those between different ones to
    little: so a row has the direction of those labelled rows to which it couples most negatively.
    """

    def __init__(self, matrix: sp.csr_array, group: NDArray, members: list[NDArray], identity: NDArray, d: int):
        off = matrix.tocoo()
        between = group[off.row] != group[off.col]
        sign = np.sign(matrix.diagonal().sum())
        entries = (-sign * off.data[between], (off.row[between], off.col[between]))
        self._coupling = sp.csr_array(entries, shape=matrix.shape)
        self._strength = np.asarray(abs(self._coupling).sum(axis=1)).ravel()
        self._members, self._live, self._d = members, ~identity, d

    def complete(self, direction: NDArray[np.int64]) -> NDArray[np.int64]:
        """Fill in directions of -1, then let every node reconsider until nothing changes."""
        direction = direction.copy()
        whole = self._members[-1]
        while True:
            best, margin = self._assign(direction)
            margin[direction >= 0] = 0
            if margin.max(initial=0) <= 0:
                loose = np.flatnonzero(direction[whole[:, 0]] < 0)
                if not len(loose):
                    break
                direction[whole[loose[0]]] = np.arange(self._d)  # a first node: its order is ours to choose
                continue
            # A twentieth more nodes at a time: late doubts meet more labelled neighbours.
            sure = np.sort(margin)[-max(1, int((direction >= 0).sum() // 20), int((margin > 0.5).sum()))]
            take = margin >= sure
            direction[take] = best[take]
        for _ in range(20):
            best, margin = self._assign(direction)
            changed = (best != direction) & (margin > 0)
            if not changed.any():
                break
            direction[changed] = best[changed]
        return np.where(direction < 0, 0, direction)

    def _assign(self, direction: NDArray) -> tuple[NDArray, NDArray]:
        """Best directions of each row's node, and by how much they beat the second best, relative."""
        known = np.flatnonzero((direction >= 0) & self._live)
        label = np.zeros((len(direction), self._d))
        label[known, direction[known]] = 1
        score = self._coupling @ label
        best = direction.copy()
        margin = np.zeros(len(direction))
        for rows in self._members:
            if len(rows):
                choices = np.array(list(permutations(range(self._d), rows.shape[1])))
                fit = score[rows[:, None, :], choices[None]].sum(axis=2)
                two = np.partition(fit, -2, axis=1)[:, -2:]
                best[rows] = choices[np.argmax(fit, axis=1)]
                size = self._strength[rows].sum(axis=1) / self._d
                margin[rows] = ((two[:, 1] - two[:, 0]) / np.where(size > 0, size, 1))[:, None]
        return best, margin
