"""Nodes and directions where rows are missing, or stand in no order: directions by sums, nodes by patterns.

The order of the rows is where the search starts. Direction by direction it tells directions; node by node it tells
those of whole nodes, from which all others spread; at random they spread from any node. With directions known, rows
that couple to the same unknowns are one node's, as far as the order allows. Where entries that vanished are not stored
patterns do not show nodes, and are made up for first.
"""

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..budget import LARGE
from ..tolerances import HARDLY_ANY, LITTLE, MOST, NEARLY_ALL
from .constants import adding_up, proven_directions, row_sizes, unaccounted, with_penalty
from .directions import spread_directions, with_least_sums
from .filling import filled, filled_by_direction
from .grouping import by_first_row, pattern_of, same_pattern, without_doubles
from .numbering import NodeNumbering, measured
from .orders import Reading, directions_by_component, nodes_by_component, nodes_in_runs


def searched(matrix: sp.csr_array, sizes: tuple[int, ...], *, as_stored: bool = False) -> list[NodeNumbering]:
    """Numberings with so many unknowns per node that were found, up to the first that leaves no doubt.

    `as_stored` believes only what entries as they are stored show, in one of the usual orders.
    """
    live, inner = live_part(matrix)
    found: list[NodeNumbering] = []
    row = np.arange(matrix.shape[0])
    for kind, d, reading in _readings(inner, sizes, as_stored):
        node, direction = row + len(live), np.zeros(len(row), np.int64)  # a row of the identity is a node by itself
        node[live], direction[live] = reading.node, reading.direction
        masks = [None if mask is None else np.isin(row, live[mask]) for mask in reading[2:]]
        one = measured(matrix, Reading(by_first_row(node), direction, *masks), d, kind)
        found.append(one)
        # Rows of each node couple to the same nodes, or nearly all do, most sums vanish and hardly a node lacks any.
        shows = one.common == 1 or (one.share >= MOST and one.quality > NEARLY_ALL * one.share)
        if one.sound and shows and not one.odd and one is max(found, key=lambda one: one.quality):
            break
    return found


def directions_in_order(
    inner: sp.csr_array, d: int, rounding: float | NDArray[np.float64]
) -> Iterator[NDArray[np.int64]]:
    """(N,) the likeliest directions of rows that stand in one of the usual orders, with gaps, their sums rounded."""
    direction = directions_by_component(inner, d, rounding)
    if direction is not None:
        yield direction
    group = same_pattern(inner)
    known = _of_runs(group, d)
    if np.mean(known >= 0) > 0.5 and inner.diagonal().all():
        direction = spread_directions(inner, group, d, known)
        yield with_least_sums(inner, group, direction, d)


def live_part(matrix: sp.csr_array) -> tuple[NDArray[np.int64], sp.csr_array]:
    """(k,) rows that couple to others, and the matrix of these."""
    live = np.flatnonzero(row_sizes(matrix))
    inner = sp.csr_array(matrix[live][:, live])
    inner.sort_indices()
    return live, inner


def _of_runs(group: NDArray[np.int64], d: int) -> NDArray[np.int64]:
    """(N,) directions of rows in runs of d neighbouring rows of one group, as those of nodes are; -1 for all others."""
    run = np.concatenate([[0], np.cumsum(np.diff(group) != 0)])
    return np.where(np.bincount(run)[run] == d, np.arange(len(run)) - np.searchsorted(run, run), -1)


def _readings(inner: sp.csr_array, sizes: tuple[int, ...], as_stored: bool) -> Iterator[tuple[str, int, Reading]]:
    """Order, number of directions, and nodes; with entries as they are stored, then with those that vanished."""
    if inner.shape[0] < 2 * min(sizes) or not inner.diagonal().all():  # an elastic body resists every displacement
        return
    size = row_sizes(inner)
    if np.mean(adding_up(inner, size) | with_penalty(inner, size)) < HARDLY_ANY:  # sums tell no directions
        return
    for d in sizes:
        direction = directions_by_component(inner, d)
        if direction is not None:
            yield "by component", d, _by_component(inner, direction, d)
    kind = "interleaved" if _in_turn(inner) else "pattern"
    if as_stored and kind == "pattern":
        return
    large = inner.shape[0] > LARGE
    for put_back in (False,) if as_stored or large else (False, True):
        whole = filled(inner) if put_back else inner
        group = same_pattern(whole)
        for d in sizes:
            shown = put_back or (large and not as_stored) or np.mean(_of_runs(group, d) >= 0) > 0.5
            if kind == "pattern" or shown:
                yield kind, d, _by_equilibrium(inner, whole, d, kind)


def _in_turn(matrix: sp.csr_array) -> bool:
    """Whether neighbouring rows couple to the same unknowns, far more than rows that stand far from each other."""
    pattern, count, half = pattern_of(matrix), np.diff(matrix.indptr), matrix.shape[0] // 2
    shares = []
    for step in (1, half):
        common = pattern[:-step].multiply(pattern[step:]).sum(axis=1)
        shares.append(float(np.mean(common / (count[:-step] + count[step:] - common))))
    return shares[0] > shares[1] + LITTLE


def _by_component(inner: sp.csr_array, direction: NDArray[np.int64], d: int) -> Reading:
    """Nodes of one pattern; where zeros are not stored, of the patterns with which no node lacks anything."""
    node, open_row = nodes_by_component(same_pattern(inner), direction, d)
    lost = _came_apart(inner, node, direction, d)
    if not (lost & ~open_row).any():
        return Reading(node, direction, open_row)
    group = same_pattern(filled_by_direction(inner, direction, d))
    node, open_row = nodes_by_component(group, direction, d)
    lost = _came_apart(inner, node, direction, d)
    if lost.any():  # each belongs to another: these go together one by one between nodes that are known
        node, open_row = nodes_by_component(np.where(lost, len(group), group), direction, d)
    return Reading(node, direction, open_row if open_row.any() else None)


def _came_apart(
    matrix: sp.csr_array, node: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> NDArray[np.bool_]:
    """(N,) rows of nodes that lack a direction without a trace."""
    return np.asarray(unaccounted(matrix, node, direction, d).any(axis=1))[node]


def _by_equilibrium(inner: sp.csr_array, whole: sp.csr_array, d: int, kind: str) -> Reading:
    """Directions spread from whole nodes, and nodes."""
    group = same_pattern(whole)
    known = _of_runs(group, d) if kind == "interleaved" else np.full(len(group), -1)
    direction = spread_directions(whole, group, d, known)
    direction = with_least_sums(whole, group, direction, d)
    if whole is not inner:
        whole = filled_by_direction(whole, direction, d)
        group = same_pattern(whole)
    if kind == "interleaved":
        node, open_row = nodes_in_runs(inner, group, direction, d), None
    else:
        node, open_row = without_doubles(group, direction, d)
    return Reading(node, direction, open_row, ~proven_directions(whole, direction, group, d))
