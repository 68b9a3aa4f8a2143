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
from .grouping import by_first_row, coupled_in_common, possible_nodes, same_pattern
from .orderly import by_component, node_by_node
from .orders import ORDERS, regular
from .sampling import promising

_ROUNDING = 1e-9
_ROUNDS = 4
_FEW = 4  # places to start from where a glance is all that a matrix gets
_ANNIHILATED = 0.02  # share of rows and directions below which an orderly numbering calls for a search
_LARGE = 20_000  # rows beyond which a few places are looked at before every row is asked
_LIKELY = 0.6  # quality of nodes apart from that share; made-up ones have half or less
_ORDERLY = 0.8  # rows of made-up nodes couple to common nodes less than this


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
    odd : int
        Nodes that lack a direction without a trace, no row near them missing it: their rows belong together, and it
        did not show.
    """

    block_size: int
    node_of_row: NDArray[np.int64]
    direction_of_row: NDArray[np.int64]
    identity_row: NDArray[np.bool_]
    kind: str
    share: float
    common: float
    odd: int = 0

    @property
    def incomplete(self) -> bool:
        """Whether some node lacks rows."""
        return len(self.node_of_row) != self.block_size * self.n_nodes

    @property
    def has_whole_node(self) -> bool:
        """Whether some node has a row for every direction."""
        return int(np.bincount(self.node_of_row).max()) == self.block_size

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
    sizes = _sizes(block_size)
    identity = uncoupled_rows(matrix)
    best = max((_regular(matrix, identity, d, kind) for d in sizes for kind in ORDERS), key=_quality)
    if best is None or _quality(best) <= 0 or best.share < 0.5 or (best.kind == "by component" and best.common < 0.9):
        hopeful = matrix.shape[0] <= _LARGE or promising(matrix, sizes)
        best = max([best, *_orderly(matrix, identity, sizes, hopeful)], key=_quality)
        if not _sound(best) and hopeful:
            best = max([best, *_searched(matrix, identity, sizes)], key=_quality)
    if best is None or _quality(best) <= 0:
        raise RecoveryError(
            f"no numbering with {block_size or '2 or 3'} unknowns per node makes the rows annihilate translations: "
            "this is no elasticity matrix, or its unknowns are scaled one by one"
        )
    return best


def numbering_at_sight(matrix: sp.csr_array) -> Numbering | None:
    """The same where it shows at once: unknowns in order, or rows of the same pattern. None if neither is so."""
    identity = uncoupled_rows(matrix)
    best = max((_regular(matrix, identity, d, kind) for d in (3, 2) for kind in ORDERS), key=_quality)
    if best is not None and best.share > 0 and best.common > _ORDERLY:
        return best
    group = same_pattern(matrix, identity)
    twins = [d for d in (3, 2) if 2 * np.count_nonzero(np.bincount(group)[group] == d) > len(group)]
    found = []
    for d in twins:
        direction = find_directions(matrix, group, identity, d, starts=_FEW) if np.bincount(group).max() <= d else None
        if direction is not None:
            found.append(_measured(matrix, identity, group, direction, d))
    return max(found, key=_quality, default=None)


def regular_numbering(matrix: sp.csr_array, kind: str, block_size: int | None = None) -> Numbering:
    """The numbering of unknowns in an order that the caller knows.

    Parameters
    ----------
    matrix : (N, N) sparse
    kind : {"interleaved", "by component"}
    block_size : int, optional

    Raises
    ------
    InputError
        If the order of the matrix is no multiple of the block size.
    RecoveryError
        If the rows of this numbering do not annihilate translations.
    """
    order = matrix.shape[0]
    sizes = [d for d in _sizes(block_size) if order % d == 0]
    if not sizes:
        raise InputError(f"a matrix with {order} rows has no numbering {kind!r} with {block_size or '2 or 3'} unknowns")
    identity = uncoupled_rows(matrix)
    best = max((_regular(matrix, identity, d, kind, checked=False) for d in sizes), key=_quality)
    if best is None or _quality(best) <= 0:
        raise RecoveryError(f"with unknowns {kind} no row annihilates translations: this is no elasticity matrix, or "
                            "its unknowns stand in another order")  # fmt: skip
    return best


def _sizes(block_size: int | None) -> tuple[int, ...]:
    if block_size not in (None, 2, 3):
        raise InputError(f"the block size is {block_size}; elasticity has 2 or 3 unknowns per node")
    return (block_size,) if block_size else (3, 2)


def _quality(one: Numbering | None) -> float:
    """Rows add up to zero, those of a node couple to the same nodes, and most nodes have all their directions."""
    if one is None or not one.has_whole_node:
        return 0.0
    return one.share * one.common * len(one.node_of_row) / (one.n_nodes * one.block_size) * (1 - one.odd / one.n_nodes)


def _sound(one: Numbering | None) -> bool:
    """Whether its nodes look like nodes, however few of their rows annihilate constants."""
    return one is not None and one.share > _ANNIHILATED and _quality(one) > _LIKELY * one.share


def _orderly(matrix: sp.csr_array, identity: NDArray, sizes: tuple[int, ...], hopeful: bool) -> list[Numbering]:
    """Numberings in one of the usual orders that lack unknowns here and there; unless hopeful, those found at once.

    Rows of the identity say nothing about where they belong; each is a node by itself.
    """
    live = np.flatnonzero(~identity)
    inner = sp.csr_array(matrix[live][:, live])
    inner.sort_indices()
    found = []
    for d in sizes:
        for kind, read in zip(ORDERS, (node_by_node, by_component), strict=True):
            if read is node_by_node and not hopeful:
                continue
            for reading in read(inner, d):
                node, direction = np.arange(matrix.shape[0]) + len(live), np.zeros(matrix.shape[0], np.int64)
                node[live], direction[live] = reading
                found.append(_measured(matrix, identity, by_first_row(node), direction, d, kind))
    return found


def _searched(matrix: sp.csr_array, identity: NDArray, sizes: tuple[int, ...]) -> list[Numbering]:
    """Numberings without any order to rely on: directions first, then nodes."""
    group = same_pattern(matrix, identity)
    found = []
    for d in (d for d in sizes if d <= len(group)):
        for start in possible_nodes(group, d):
            node = start
            for _ in range(_ROUNDS):  # directions tell nodes apart, and nodes help to find directions
                direction = find_directions(matrix, node, identity, d)
                found.append(_measured(matrix, identity, node, direction, d))
                if found[-1].share > 0.5 and _sound(found[-1]):
                    return found
                merged = nodes_by_neighbours(matrix, direction, d)
                if len(np.unique(merged * d + direction)) < len(merged) or merged.max() == node.max():
                    break
                node = by_first_row(merged)
                found.append(_measured(matrix, identity, node, direction, d))
    return found


def _measured(
    matrix: sp.csr_array, identity: NDArray, node: NDArray, direction: NDArray, d: int, kind: str = "pattern"
) -> Numbering:
    share, common = _share(matrix, identity, direction, d, searched=True), coupled_in_common(matrix, node, direction)
    return Numbering(d, node, direction, identity, kind, share, common, _odd(matrix, identity, node, direction, d))


def _odd(matrix: sp.csr_array, identity: NDArray, node: NDArray, direction: NDArray, d: int) -> int:
    """Number of nodes that lack a direction although all rows coupled to them annihilate it."""
    order, n, live = len(node), int(node.max()) + 1, ~identity
    labels = np.zeros((order, d))
    labels[np.flatnonzero(live), direction[live]] = 1
    size = np.asarray(abs(matrix).sum(axis=1)).ravel()
    missing = (np.abs(matrix @ labels) > _ROUNDING * size[:, None]) & live[:, None]
    pattern = sp.csr_array((np.ones(matrix.nnz, np.int8), matrix.indices, matrix.indptr), shape=matrix.shape)
    onto = sp.csr_array((np.ones(order, np.int32), (node, np.arange(order))), shape=(n, order))
    missed = onto @ (pattern.astype(np.int32) @ missing.astype(np.int32))
    present = (onto @ labels) > 0
    return int((~present & (missed == 0) & present.any(axis=1)[:, None]).any(axis=1).sum())


def uncoupled_rows(matrix: sp.csr_array) -> NDArray[np.bool_]:
    """(N,) rows without an entry off the diagonal, as those of the identity."""
    off = matrix.copy()
    off.setdiag(0)
    return np.asarray(abs(off).sum(axis=1)).ravel() == 0


def _regular(matrix: sp.csr_array, identity: NDArray, d: int, kind: str, *, checked: bool = True) -> Numbering | None:
    """One of the two numberings that need no search, if order and pattern allow it."""
    order = matrix.shape[0]
    if order % d:
        return None
    node, direction = regular(order, d, kind)
    common = coupled_in_common(matrix, node, direction)
    if checked and common < 0.6:
        return None
    return Numbering(d, node, direction, identity, kind, _share(matrix, identity, direction, d), common)


def _share(matrix: sp.csr_array, identity: NDArray, direction: NDArray, d: int, *, searched: bool = False) -> float:
    """Share of pairs (row, direction) that annihilate constants.

    Only rows count that annihilate their own direction and another one to which they do couple: sums of nothing are
    no evidence. Where no row couples to another direction, as in vector Laplacians, none needs to, unless the
    directions are the result of a search, which would find any halves of any mesh.
    """
    live = ~identity
    if not live.any():
        return 0.0
    ones = np.zeros((len(direction), d))
    ones[np.flatnonzero(live), direction[live]] = 1
    off = abs(matrix).sum(axis=1) - np.abs(matrix.diagonal())
    size = np.asarray(off).ravel()[live]
    zero = np.abs(matrix @ ones)[live] <= _ROUNDING * size[:, None]
    own = zero[np.arange(len(size)), direction[live]]
    other = np.arange(d) != direction[live][:, None]
    coupled = other & ((abs(matrix) @ ones)[live] > _ROUNDING * size[:, None])
    if searched or coupled.any():
        own &= (zero & coupled).any(axis=1)
    return float((zero & own[:, None]).mean())


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
    node = by_first_row(node)
    if len(np.unique(node * d + direction)) < order:
        raise InputError("two rows have the same node and direction")
    identity = uncoupled_rows(matrix)
    share, common = _share(matrix, identity, direction, d, searched=True), coupled_in_common(matrix, node, direction)
    return Numbering(d, node, direction, identity, "given", share, common)
