"""Which rows of a matrix belong to one node, and to which direction each of them.

Two kinds of evidence decide. Constants: in the right numbering the columns of one direction add up to zero in
the rows of interior nodes. And the pattern: the unknowns of a node couple to the same unknowns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import InputError, RecoveryError
from .directions import find_directions, nodes_by_neighbours

_ROUNDING = 1e-9
_ROUNDS = 4


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
    kind : {"interleaved", "by component", "pattern", "given"}
    share : float
        Share of the pairs (row, direction) whose entries add up to zero, among rows that couple.
    common : float
        How far the rows of a node couple to the same nodes: 1 if all do.
    """

    block_size: int
    node_of_row: NDArray[np.int64]
    direction_of_row: NDArray[np.int64]
    identity_row: NDArray[np.bool_]
    kind: str
    share: float
    common: float

    @property
    def incomplete(self) -> bool:
        """Whether some node lacks rows."""
        return len(self.node_of_row) != self.block_size * self.n_nodes

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
    best = max(found, key=_quality)
    if best is None or best.share < 0.5 or (best.kind == "by component" and best.common < 0.9):
        best = max([best, *_searched(matrix, identity, sizes)], key=_quality)
    if best is None or best.share <= 0:
        raise RecoveryError(
            "no numbering with 2 or 3 unknowns per node makes the rows annihilate translations: this is no "
            "elasticity matrix, or its unknowns are scaled one by one"
        )
    return best


def _quality(one: Numbering | None) -> float:
    """Rows add up to zero, those of a node couple to the same nodes, and most nodes have all their directions."""
    if one is None:
        return 0.0
    return one.share * one.common * len(one.node_of_row) / (one.n_nodes * one.block_size)


def _searched(matrix: sp.csr_array, identity: NDArray, sizes: tuple[int, ...]) -> list[Numbering]:
    """Numberings without any order to rely on: directions first, then nodes."""
    group = _same_pattern(matrix, identity)
    found = []
    for d in sizes:
        whole = group if np.bincount(group).max() <= d else _split(group, d)
        starts = [whole] if np.bincount(whole).max() <= d else []
        for start in [*starts, np.arange(len(group))]:
            node = start
            for _ in range(_ROUNDS):  # directions tell nodes apart, and nodes help to find directions
                direction = find_directions(matrix, node, identity, d)
                found.append(_measured(matrix, identity, node, direction, d))
                merged = nodes_by_neighbours(matrix, direction, d)
                if len(np.unique(merged * d + direction)) < len(merged) or merged.max() == node.max():
                    break
                node = _by_first_row(merged)
                found.append(_measured(matrix, identity, node, direction, d))
    return found


def _measured(matrix: sp.csr_array, identity: NDArray, node: NDArray, direction: NDArray, d: int) -> Numbering:
    share, common = _share(matrix, identity, direction, d), _common(matrix, node, direction)
    return Numbering(d, node, direction, identity, "pattern", share, common)


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
    common = _common(matrix, node, direction)
    if common < 0.6:
        return None
    return Numbering(d, node, direction, identity, kind, _share(matrix, identity, direction, d), common)


def _common(matrix: sp.csr_array, node: NDArray, direction: NDArray) -> float:
    """How far the rows of one node couple to the same nodes: 1 if all do, about 1 / d if their nodes are made up."""
    n = node.max() + 1
    onto = sp.csr_array((np.ones(len(node), np.int32), (np.arange(len(node)), node)), shape=(len(node), n))
    pattern = sp.csr_array((np.ones(matrix.nnz, np.int32), matrix.indices, matrix.indptr), shape=matrix.shape)
    rows = pattern @ onto
    union = (onto.T.tocsr() @ rows).tocsr()
    return rows.nnz / float(np.diff(union.indptr) @ np.bincount(node))


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


def given_numbering(matrix: sp.csr_array, node_of_row: NDArray, direction_of_row: NDArray) -> Numbering:
    """A numbering that the caller knows.

    Raises
    ------
    InputError
        If two rows have the same node and direction, or the arrays do not fit the matrix.
    """
    node, direction = np.asarray(node_of_row, dtype=np.int64), np.asarray(direction_of_row, dtype=np.int64)
    order = matrix.shape[0]
    if node.shape != (order,) or direction.shape != (order,):
        raise InputError(f"node and direction are needed for each of the {order} rows")
    d = int(direction.max()) + 1
    if d not in (2, 3) or direction.min() < 0:
        raise InputError("directions are numbered 0, 1 and, in space, 2")
    node = _by_first_row(node)
    if len(np.unique(node * d + direction)) < order:
        raise InputError("two rows have the same node and direction")
    identity = _uncoupled_rows(matrix)
    share, common = _share(matrix, identity, direction, d), _common(matrix, node, direction)
    return Numbering(d, node, direction, identity, "given", share, common)
