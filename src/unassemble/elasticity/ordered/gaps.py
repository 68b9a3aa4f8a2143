"""Unknowns in one of the two usual orders, some of which were taken out.

Rows of the identity do not say where they belong; each is a node by itself.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..rows.constants import uncoupled_rows
from ..rows.grouping import by_first_row, same_pattern
from ..rows.numbering import Numbering, measured
from ..rows.orders import Reading
from .components import by_component, directions_by_component
from .held import Places
from .runs import run_lengths, told_by_likeness, told_by_pattern


def by_component_with_gaps(matrix: sp.csr_array, sizes: tuple[int, ...]) -> list[Numbering]:
    """Numberings direction by direction for each block size for which they show."""
    live, inner = _live_part(matrix)
    found = []
    for d in sizes:
        one = by_component(inner, d, Places(live, matrix.shape[0]))
        if one is not None:
            found.append(_spread(matrix, live, one, d, "by component"))
            if found[-1].settled:
                break
    return found


def same_cuts(matrix: sp.csr_array, regular: Numbering) -> bool:
    """Whether rows show the same cuts between directions as the order without gaps has, so that it is the only one."""
    live, inner = _live_part(matrix)
    direction = directions_by_component(inner, regular.block_size)
    return direction is not None and np.array_equal(direction, regular.direction_of_row[live])


def interleaved_with_gaps(matrix: sp.csr_array, sizes: tuple[int, ...]) -> list[Numbering]:
    """Numberings node by node for each block size; where equal patterns show every node, nothing else is tried."""
    told = interleaved_by_pattern(matrix, sizes)
    if told is not None:
        return [told]
    live, inner = _live_part(matrix)
    found: list[Numbering] = []
    for d in _likeliest_first(inner, sizes):
        found += [_spread(matrix, live, one, d, "interleaved") for one in told_by_likeness(inner, d)]
        if any(one.settled for one in found):
            break
    return found


def interleaved_by_pattern(matrix: sp.csr_array, sizes: tuple[int, ...]) -> Numbering | None:
    """The numbering node by node where patterns show every node; None where they do not."""
    live, inner = _live_part(matrix)
    told = told_by_pattern(inner, sizes)
    return None if told is None else _spread(matrix, live, told[1], told[0], "interleaved")


def _likeliest_first(matrix: sp.csr_array, sizes: tuple[int, ...]) -> list[int]:
    """Sizes of nodes, that first of which most neighbouring rows of one pattern are."""
    length = run_lengths(same_pattern(matrix, np.zeros(matrix.shape[0], dtype=bool)))
    return sorted(sizes, key=lambda d: -np.count_nonzero(length == d))


def _live_part(matrix: sp.csr_array) -> tuple[NDArray[np.int64], sp.csr_array]:
    live = np.flatnonzero(~uncoupled_rows(matrix))
    inner = sp.csr_array(matrix[live][:, live])
    inner.sort_indices()
    return live, inner


def _spread(matrix: sp.csr_array, live: NDArray[np.int64], one: Reading, d: int, kind: str) -> Numbering:
    """The numbering of all rows from that of live ones."""
    order = matrix.shape[0]
    node, direction = np.arange(order) + len(live), np.zeros(order, np.int64)
    node[live], direction[live] = one.node, one.direction
    masks = []
    for mask in (one.open_row, one.unnamed):
        masks.append(None if mask is None else np.isin(np.arange(order), live[mask]))
    return measured(matrix, by_first_row(node), direction, d, kind, *masks)
