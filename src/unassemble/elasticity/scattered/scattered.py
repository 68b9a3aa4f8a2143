"""Unknowns that stand in no order: directions spread from one node, and rows of one pattern make up nodes.

Where entries that vanished are not stored they are put back first, as far as likeness tells.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..directions.extension import SETTLED, extended_directions
from ..directions.least_sums import named_by_least_sums
from ..directions.sums import names_of, set_right
from ..rows.constants import (
    ROUNDING,
    adding_up,
    proven_directions,
    row_sizes,
    uncoupled_rows,
    with_penalty,
    without_penalties,
)
from ..rows.grouping import possible_nodes, same_pattern
from ..rows.numbering import Numbering, measured
from ..rows.traces import unaccounted
from .exchange import exchanged, fullest
from .filling import filled, filled_by_direction, likest
from .patterns import by_direction
from .row_positions import placed_together, single_nodes

_ORDERED = 0.3  # share of neighbouring rows with the same pattern: 2/3 node by node, some more where nodes share one
_HOPEFUL = 0.1  # share of whole rows that annihilate translations, below which the number of directions is wrong
_SETTLED = 0.9  # share of whole rows that have to annihilate translations
_ROUNDS = 4
_EVEN = 0.6  # share of rows, far from supports, in patterns with as many rows in each direction


def scattered(matrix: sp.csr_array, sizes: tuple[int, ...]) -> Numbering | None:
    """The numbering with which all rows that can annihilate translations do; None where none is found.

    None, too, where rows of one node do not couple to the same unknowns, since zeros were dropped.

    Parameters
    ----------
    matrix : (N, N) sparse
    sizes : tuple of int
        Block sizes to try.
    """
    identity = uncoupled_rows(matrix)
    live = np.flatnonzero(~identity)
    group = same_pattern(matrix, identity)
    inner = group[live]
    if len(live) < 2 or np.mean(inner[1:] == inner[:-1]) > _ORDERED:
        return None
    for d in sizes:
        if 2 * np.count_nonzero(np.bincount(inner)[inner] >= d) < len(live):
            continue  # rows of one node do not show by their pattern
        direction, share = _directions(matrix, group, ~identity, d)
        if share > _SETTLED and _even_share(matrix, group, direction, ~identity, d) > _EVEN:
            likely = _likely_nodes(matrix, group, direction, identity, d, clearly=False, apart=False)
            return likely or _with_nodes(matrix, matrix, group, direction, identity, d)
    return None


def more_careful(matrix: sp.csr_array, numbering: Numbering) -> Iterator[Numbering]:
    """The same directions with nodes that likeness tells clearly, then with none that may be several; if these differ.

    Parameters
    ----------
    matrix : (N, N) sparse
        Entries that vanish are stored.
    numbering : Numbering
        With nodes that likeness told, however faintly.
    """
    identity, direction = numbering.identity_row, numbering.direction_of_row
    group = same_pattern(matrix, identity)
    before = [numbering.node_of_row]
    for apart in (False, True):
        one = _likely_nodes(matrix, group, direction, identity, numbering.block_size, clearly=True, apart=apart)
        if one is not None and not any(np.array_equal(one.node_of_row, other) for other in before):
            before.append(one.node_of_row)
            yield one


def told_by_positions(matrix: sp.csr_array, numbering: Numbering) -> Numbering | None:
    """The same directions with nodes that positions of rows tell, and likeness does not.

    None where some node lacks a direction without a trace that no other row offers.

    Parameters
    ----------
    matrix : (N, N) sparse
        Entries that vanish are stored.
    numbering : Numbering
    """
    identity, direction = numbering.identity_row, numbering.direction_of_row
    return _with_nodes(matrix, matrix, same_pattern(matrix, identity), direction, identity, numbering.block_size)


def _likely_nodes(
    matrix: sp.csr_array,
    group: NDArray[np.int64],
    direction: NDArray[np.int64],
    identity: NDArray[np.bool_],
    d: int,
    *,
    clearly: bool,
    apart: bool,
) -> Numbering | None:
    """Nodes that likeness tells, and positions only where it does not; None where it tells no more than patterns do.

    Rows of a pattern are left open where some of them found no node.
    """
    single = single_nodes(group, direction, d)
    node = exchanged(matrix, ~identity, group, single, direction, d, clearly=clearly, apart=apart)
    if np.array_equal(node, single):
        return None
    base = fullest(matrix, ~identity, group, direction, d)[group]
    found = by_direction(node, direction, d)[node, np.maximum(base, 0)] > 0
    lost = np.bincount(group, np.where(base < 0, apart, ~found))[group] > 0
    numbering = _with_nodes(matrix, matrix, group, direction, identity, d, node, lost & ~identity)
    if numbering is None or numbering.open_row is None:
        return None
    return replace(numbering, likely=True, open_row=numbering.open_row & (base >= 0))


def scattered_without_zeros(matrix: sp.csr_array, sizes: tuple[int, ...]) -> Numbering | None:
    """The same where entries that vanished are not stored, and put back; None where it does not settle directions.

    Nothing but likeness says then which rows belong together. Rows of nodes that lack a direction without a trace are
    left open.

    Parameters
    ----------
    matrix : (N, N) sparse
    sizes : tuple of int
        Block sizes to try.
    """
    identity = uncoupled_rows(matrix)
    start = likest(matrix)
    whole = filled(matrix, start)
    for d in sizes:
        direction, share = extended_directions(whole, start, ~identity, d, sure=False)
        if share < SETTLED:
            direction, share = max(
                (direction, share),
                extended_directions(whole, same_pattern(whole, identity), ~identity, d),
                key=lambda one: one[1],
            )
        if share <= _SETTLED:
            continue
        more = filled_by_direction(whole, direction, ~identity, d)
        group = same_pattern(more, identity)
        direction = _set_right(more, group, direction, ~identity, d)
        if _even_share(more, group, direction, ~identity, d) > _EVEN:
            return _with_nodes(matrix, more, group, direction, identity, d)
    return None


def _directions(
    matrix: sp.csr_array, group: NDArray[np.int64], live: NDArray[np.bool_], d: int
) -> tuple[NDArray[np.int64], float]:
    """Directions, and the share of the whole rows that annihilate translations with them.

    Translations are not in equilibrium next to supports, and where few rows are far from any, wrong directions there
    spoil most sums. So all sums together decide on the rows whose direction nothing proves, until none changes.
    """
    direction, share = extended_directions(matrix, group, live, d)
    if share < _HOPEFUL:
        return direction, share
    told = without_penalties(matrix)
    direction = _set_right(told, group, direction, live, d)
    for _ in range(_ROUNDS):
        unnamed = ~proven_directions(matrix, direction, group, d) & live
        other = named_by_least_sums(told, direction, unnamed, d, exactly=False)
        if np.array_equal(other, direction):
            break
        direction = _set_right(told, group, other, live, d)
    return direction, _share(matrix, direction, live, d)


def _share(matrix: sp.csr_array, direction: NDArray[np.int64], live: NDArray[np.bool_], d: int) -> float:
    """Share of the rows that add up to zero over all directions together which do so over each."""
    size = row_sizes(matrix)
    whole = adding_up(matrix, size) & ~with_penalty(matrix, size) & live
    sums = np.abs(matrix @ (np.eye(d)[direction] * live[:, None]))
    return float((sums <= ROUNDING * size[:, None]).all(axis=1)[whole].mean()) if whole.any() else 0.0


def _even_share(
    matrix: sp.csr_array, group: NDArray[np.int64], direction: NDArray[np.int64], live: NDArray[np.bool_], d: int
) -> float:
    """Share of rows whose pattern has as many rows in each direction, where all of them add up to zero.

    Two directions of three taken for one annihilate translations as well.
    """
    size = row_sizes(matrix)
    adds_up = adding_up(matrix, size) | with_penalty(matrix, size)
    count = by_direction(group, direction, d)
    whole = live & (np.bincount(group, ~adds_up) == 0)[group]
    return float((count == count[:, :1]).all(axis=1)[group[whole]].mean()) if whole.any() else 0.0


def _with_nodes(
    matrix: sp.csr_array,
    whole: sp.csr_array,
    group: NDArray[np.int64],
    direction: NDArray[np.int64],
    identity: NDArray[np.bool_],
    d: int,
    node: NDArray[np.int64] | None = None,
    open_row: NDArray[np.bool_] | None = None,
) -> Numbering | None:
    """Nodes of rows whose directions are known; `whole` is the matrix with zeros, by which rows are grouped.

    None where no zeros were put back, but some node lacks a direction without a trace that no other row offers. Nodes
    to start from, and rows that may be joined to others, are those that patterns show where not given.
    """
    node = single_nodes(group, direction, d) if node is None else node
    node, open_row = placed_together(whole, ~identity, group, node, direction, d, open_row)
    lost = np.asarray(unaccounted(whole, ~identity, node, direction, d).any(axis=1))[node]
    if whole is not matrix:
        open_row |= lost
    elif (lost & (np.bincount(node, open_row)[node] == 0)).any():
        return None
    unnamed = ~proven_directions(whole, direction, group, d) & ~identity
    return replace(measured(matrix, node, direction, d), open_row=open_row, unnamed=unnamed, group=group)


def _set_right(
    matrix: sp.csr_array, group: NDArray[np.int64], direction: NDArray[np.int64], live: NDArray[np.bool_], d: int
) -> NDArray[np.int64]:
    """Directions next to supports, where translations are in equilibrium no more, set right by the rows around."""
    node = possible_nodes(group, d)[0]
    order, size = np.argsort(node, kind="stable"), np.bincount(node)
    many = size[node[order]]
    members = [order[many == k].reshape(-1, k) for k in range(1, d + 1)]
    return set_right(matrix, node, members, live, direction, names_of(d))
