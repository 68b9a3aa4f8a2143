"""Unknowns that stand direction by direction, but some of which were taken out.

Rollers and symmetry planes eliminate single directions of nodes. No stride fits the rest; but the directions are
d stretches of the rows, with nodes in the same order in each.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..rows.constants import ROUNDING
from ..rows.grouping import same_pattern
from ..rows.orders import Reading
from ..rows.traces import shows_all
from ..scattered.filling import filled_by_direction
from ..scattered.row_positions import placed_together
from .held import Places, joined_by_place
from .matching import matched_by_likeness, matched_by_pattern

_VOTES = 0.5  # share of the rows that add up to zero that has to vote for a cut: nearly all do, or a few by chance


def by_component(matrix: sp.csr_array, d: int, places: Places) -> Reading | None:
    """Nodes and directions of rows that stand direction by direction; None where no such order shows.

    Parameters
    ----------
    matrix : (N, N) sparse
        Without rows of the identity; columns increasing in each row.
    d : int
    places : Places
        Of the rows among those of the identity.
    """
    direction = directions_by_component(matrix, d)
    if direction is None:
        return None
    stored = _by_pattern(matrix, direction, d, places)
    if _shows_nodes(matrix, stored, d):
        return stored
    whole = filled_by_direction(matrix, direction, np.ones(len(direction), dtype=bool), d)
    put_back = _by_pattern(whole, direction, d, places)
    alike = Reading(matched_by_likeness(matrix, direction, d), direction)
    fewer = put_back.node.max() < alike.node.max()  # rows of one node that stay apart make two
    if not fewer or not _shows_nodes(whole, put_back, d):
        return alike
    none_open = put_back.open_row is None or not put_back.open_row.any()
    return Reading(put_back.node, direction) if none_open else put_back  # that patterns show them is an inference here


def _shows_nodes(matrix: sp.csr_array, reading: Reading, d: int) -> bool:
    """Whether most rows belong to whole nodes, and all others are left open or lack what was taken out."""
    many = 2 * np.count_nonzero(np.bincount(reading.node)[reading.node] == d) > len(reading.node)
    return bool(many) and shows_all(matrix, reading, d)


def _by_pattern(matrix: sp.csr_array, direction: NDArray[np.int64], d: int, places: Places) -> Reading:
    """Nodes of rows of the same pattern, as far as order and positions decide."""
    everywhere = np.ones(matrix.shape[0], dtype=bool)
    group = same_pattern(matrix, ~everywhere)
    node, open_row = matched_by_pattern(group, direction, d)
    node, open_row = joined_by_place(places, group, node, direction, d, open_row)
    if open_row.any():
        node, open_row = placed_together(matrix, everywhere, group, node, direction, d, open_row, ordered=True)
    return Reading(node, direction, open_row)


def directions_by_component(
    matrix: sp.csr_array, d: int, rounding: float | NDArray[np.float64] = ROUNDING
) -> NDArray[np.int64] | None:
    """(N,) directions that increase; None where no cuts between them show, with sums relative to rows rounded so."""
    cuts = _cuts(matrix, d, rounding)
    return None if cuts is None else np.searchsorted(cuts, np.arange(matrix.shape[0]), side="right")


def _cuts(matrix: sp.csr_array, d: int, rounding: float | NDArray[np.float64]) -> NDArray[np.int64] | None:
    """(d - 1,) first rows of all directions but the first.

    A row that annihilates constants direction by direction does so up to each cut: sums over its first columns vanish
    there. Each row votes for all places between two of its columns where they do.
    """
    order = matrix.shape[0]
    least = rounding * np.add.reduceat(np.abs(matrix.data), matrix.indptr[:-1])
    row = np.repeat(np.arange(order), np.diff(matrix.indptr))
    partial = _running_sums(matrix)
    inner = np.ones(matrix.nnz, dtype=bool)
    inner[matrix.indptr[1:] - 1] = False
    whole = np.abs(partial[matrix.indptr[1:] - 1]) <= least
    place = np.flatnonzero(inner & whole[row] & (np.abs(partial) <= least[row]))
    first, last = matrix.indices[place] + 1, matrix.indices[place + 1] + 1
    cuts: list[int] = []
    for _ in range(d - 1):
        votes = np.cumsum(np.bincount(first, minlength=order + 2) - np.bincount(last, minlength=order + 2))
        if votes.max() <= _VOTES * whole.sum():
            return None
        best = np.flatnonzero(votes == votes.max())
        run = best[: int(np.argmax(np.append(np.diff(best) > 1, True))) + 1]
        cut = _settled(matrix, int(run[0]), int(run[-1]))
        cuts.append(cut)
        elsewhere = (last <= run[0]) | (first > run[-1])
        first, last = first[elsewhere], last[elsewhere]
    return np.sort(np.array(cuts))


def _running_sums(matrix: sp.csr_array) -> NDArray[np.float64]:
    """(nnz,) sums of each row's entries up to and including each."""
    count = np.diff(matrix.indptr)
    sums = matrix.data.copy()
    at = matrix.indptr[:-1].astype(np.int64)
    for k in range(1, int(count.max(initial=0))):  # as many steps as the longest row has entries
        here = at[count > k] + k
        sums[here] += sums[here - 1]
    return sums


def _settled(matrix: sp.csr_array, first: int, last: int) -> int:
    """The cut among places that all have the same votes: that for which directions have the least energy."""
    rows = np.arange(first, last)
    part = sp.coo_array(matrix[rows])
    below = np.bincount(part.row, part.data * (part.col < rows[part.row]), len(rows))
    above = np.bincount(part.row, part.data * (part.col > rows[part.row]), len(rows))
    step = np.sign(matrix.diagonal().sum()) * (below - above)  # of the energy, as one more row comes below the cut
    return first + int(np.argmin(np.concatenate([[0.0], np.cumsum(step)])))
