"""Unknowns in one of the two usual orders, some of which were taken out.

Rows of the identity do not say where they belong; each is a node by itself.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .components import by_component
from .constants import uncoupled_rows
from .grouping import by_first_row
from .numbering import Numbering, measured
from .orders import Reading
from .runs import node_by_node, told_by_pattern


def by_component_with_gaps(matrix: sp.csr_array, sizes: tuple[int, ...]) -> list[Numbering]:
    """Numberings direction by direction for each block size for which they show."""
    live, inner = _live_part(matrix)
    readings = [(d, by_component(inner, d)) for d in sizes]
    return [_spread(matrix, live, one, d, "by component") for d, one in readings if one is not None]


def interleaved_with_gaps(matrix: sp.csr_array, sizes: tuple[int, ...]) -> list[Numbering]:
    """Numberings node by node for each block size."""
    live, inner = _live_part(matrix)
    return [_spread(matrix, live, one, d, "interleaved") for d, one in node_by_node(inner, sizes)]


def interleaved_by_pattern(matrix: sp.csr_array, sizes: tuple[int, ...]) -> Numbering | None:
    """The numbering node by node where patterns show every node; None where they do not."""
    live, inner = _live_part(matrix)
    told = told_by_pattern(inner, sizes)
    return None if told is None else _spread(matrix, live, told[1], told[0], "interleaved")


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
