"""Nodes and directions of rows that stand in no order: each helps to find the other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..directions.directions import find_directions, nodes_by_neighbours
from ..directions.sums import names_of, set_right
from ..rows.constants import uncoupled_rows, whole_share
from ..rows.grouping import by_first_row, possible_nodes, same_pattern
from ..rows.numbering import Numbering, measured
from .bunches import bunched
from .leftover import leftover_joined

_ROUNDS = 4
_RIGHT = 0.98  # share of rows, of those that add up to zero, that do so by directions, if these are right


def searched(matrix: sp.csr_array, sizes: tuple[int, ...]) -> list[Numbering]:
    """Numberings for each block size, or the first that makes all rows that add up to zero do so by directions.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric.
    sizes : tuple of int
    """
    identity = uncoupled_rows(matrix)
    whole = _RIGHT * whole_share(matrix, identity)
    found: list[Numbering] = []
    right: list[Numbering] = []
    for d, node, first in _starts(matrix, identity, [d for d in sizes if d <= matrix.shape[0]]):
        if right and not first:
            break
        for one in _rounds(matrix, identity, node, d):
            found.append(_freed(matrix, one) if one.sound else one)
            if found[-1].sound and found[-1].share >= whole:
                right += _both_ways(matrix, found[-1])
                break
        if any(not one.odd for one in right):
            break
    return right or found


def _both_ways(matrix: sp.csr_array, one: Numbering) -> list[Numbering]:
    """Right directions with the nodes that helped to find them, and with those that they tell apart."""
    d, direction = one.block_size, one.direction_of_row
    paired = _paired(matrix, one.identity_row, direction, d)
    return [one] if paired is None else [one, measured(matrix, paired, direction, d)]


def _starts(matrix: sp.csr_array, identity: NDArray, sizes: list[int]) -> Iterator[tuple[int, NDArray[np.int64], bool]]:
    """What may be nodes, the likeliest first, and whether to look on though directions are right.

    Rows of one pattern, if most have a fellow; rows that are likest each other; rows of one pattern all the same; and
    single rows.
    """
    group = same_pattern(matrix, identity)
    patterns = [(d, node) for d in sizes for node in possible_nodes(group, d)[:-1]]
    clear = [2 * np.count_nonzero(np.bincount(node)[node] > 1) > len(node) for _, node in patterns]
    yield from ((*one, True) for one, first in zip(patterns, clear, strict=True) if first)
    for d in sizes:
        yield d, bunched(matrix, d), True
    yield from ((*one, False) for one, first in zip(patterns, clear, strict=True) if not first)
    yield from ((d, np.arange(len(group)), False) for d in sizes)


def _rounds(matrix: sp.csr_array, identity: NDArray, node: NDArray[np.int64], d: int) -> Iterator[Numbering]:
    """Directions tell nodes apart, and nodes help to find directions."""
    for _ in range(_ROUNDS):
        direction = find_directions(matrix, node, identity, d)
        yield measured(matrix, node, direction, d)
        paired = _paired(matrix, identity, direction, d)
        if paired is None or paired.max() == node.max():
            break
        node = paired
        yield measured(matrix, node, direction, d)


def _paired(matrix: sp.csr_array, identity: NDArray, direction: NDArray[np.int64], d: int) -> NDArray[np.int64] | None:
    """(N,) nodes of rows whose directions are known; None where two rows of one direction meet."""
    node = nodes_by_neighbours(matrix, direction, d)
    if len(np.unique(node * d + direction)) < len(node):
        return None
    return leftover_joined(matrix, ~identity, by_first_row(node), direction, d)


def _freed(matrix: sp.csr_array, one: Numbering) -> Numbering:
    """The same after rows have chosen directions for themselves: all of them, if more sums vanish then.

    And those of nodes that lack a direction, if no fewer do: rows of the same direction may have been taken for such a
    node, next to supports, where no sums tell.
    """
    d, order = one.block_size, matrix.shape[0]
    row = np.arange(order)
    single = [row[:, None], *[np.empty((0, k), np.int64) for k in range(2, d + 1)]]
    direction = set_right(matrix, row, single, ~one.identity_row, one.direction_of_row, names_of(d))
    other = _with_directions(matrix, one, direction)
    best = other if other.share > one.share else one
    other = _with_directions(matrix, best, _of_least_energy(matrix, best))
    return other if other.share >= best.share else best


def _of_least_energy(matrix: sp.csr_array, one: Numbering) -> NDArray[np.int64]:
    """(N,) directions after rows of nodes that lack some have taken those of least energy, all others left alone."""
    d, order = one.block_size, matrix.shape[0]
    count = np.bincount(one.node_of_row)[one.node_of_row]
    rows = np.flatnonzero((count > 1) & (count < d))
    label = np.zeros((order, d))
    label[np.arange(order), one.direction_of_row] = ~one.identity_row
    energy = matrix[rows] @ label
    energy[np.arange(len(rows)), one.direction_of_row[rows]] -= matrix.diagonal()[rows]
    direction = one.direction_of_row.copy()
    direction[rows] = np.argmin(energy * np.sign(matrix.diagonal().sum()), axis=1)
    return direction


def _with_directions(matrix: sp.csr_array, one: Numbering, direction: NDArray[np.int64]) -> Numbering:
    """The same with other directions; nodes in which two rows have the same come apart."""
    if np.array_equal(direction, one.direction_of_row):
        return one
    d = one.block_size
    key = one.node_of_row * d + direction
    twice = np.bincount(one.node_of_row, np.bincount(key)[key] > 1)[one.node_of_row] > 0
    node = by_first_row(np.where(twice, len(key) + np.arange(len(key)), one.node_of_row))
    node = leftover_joined(matrix, ~one.identity_row, node, direction, d)
    return measured(matrix, node, direction, d)
