"""Unknowns that stand in no order, in matrices that store entries even where they vanish."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .coincidence import placed_together, single_nodes
from .constants import proven_directions, uncoupled_rows
from .extension import extended_directions
from .grouping import possible_nodes, same_pattern
from .numbering import Numbering, measured
from .sums import names_of, set_right

_ORDERED = 0.3  # share of neighbouring rows with the same pattern: 2/3 node by node, some more where nodes share one
_SETTLED = 0.9  # share of whole rows that have to annihilate translations


def scattered(matrix: sp.csr_array, sizes: tuple[int, ...]) -> Numbering | None:
    """The numbering with which all rows that can annihilate translations do; None where none is found.

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
        direction, share = extended_directions(matrix, group, ~identity, d)
        if share > _SETTLED:
            return _with_nodes(matrix, group, direction, identity, d)
    return None


def _with_nodes(
    matrix: sp.csr_array, group: NDArray[np.int64], direction: NDArray[np.int64], identity: NDArray[np.bool_], d: int
) -> Numbering:
    direction = _set_right(matrix, group, direction, ~identity, d)
    node = single_nodes(group, direction, d)
    node, open_row = placed_together(matrix, ~identity, group, node, direction, d)
    unnamed = ~proven_directions(matrix, direction, group, d) & ~identity
    return replace(measured(matrix, node, direction, d), open_row=open_row, unnamed=unnamed)


def _set_right(
    matrix: sp.csr_array, group: NDArray[np.int64], direction: NDArray[np.int64], live: NDArray[np.bool_], d: int
) -> NDArray[np.int64]:
    """Directions next to supports, where translations are in equilibrium no more, set right by the rows around."""
    node = possible_nodes(group, d)[0]
    order, size = np.argsort(node, kind="stable"), np.bincount(node)
    many = size[node[order]]
    members = [order[many == k].reshape(-1, k) for k in range(1, d + 1)]
    return set_right(matrix, node, members, live, direction, names_of(d))
