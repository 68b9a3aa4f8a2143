"""Unknowns that stand node by node, but some of which were taken out.

Rollers and symmetry planes eliminate single directions of nodes. No stride fits the rest; but directions increase
within each node.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..directions.directions import find_directions, reconsidered
from ..directions.extension import extended_directions
from ..directions.least_sums import named_by_least_sums
from ..directions.plane_names import named_by_sums
from ..rows.constants import proven_directions
from ..rows.grouping import by_first_row, same_pattern
from ..rows.likeness import alike, doubtful, likest, next_to_likest, reach
from ..rows.numbering import WHOLE
from ..rows.orders import Reading
from ..rows.traces import shows_all, unaccounted

_ROUNDS = 3
_IN_TURN = 0.12  # share of rows next to the one likest them below which nodes do not stand one after the other


def told_by_pattern(matrix: sp.csr_array, sizes: tuple[int, ...]) -> tuple[int, Reading] | None:
    """How many directions there are, and nodes and directions, where runs of rows of equal patterns show every node."""
    order = matrix.shape[0]
    group = same_pattern(matrix, np.zeros(order, dtype=bool))
    run, length = _runs(group), run_lengths(group)
    for d in sizes:
        if order >= 2 * d and 2 * np.count_nonzero(length == d) > order:
            found = _by_pattern(matrix, group, run, d)
            if shows_all(matrix, found, d):
                return d, found
    return None


def run_lengths(group: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N,) how many neighbouring rows of one group each row stands among."""
    run = _runs(group)
    return np.bincount(run)[run]


def _runs(group: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N,) runs of neighbouring rows of one group."""
    return np.concatenate([[0], np.cumsum(group[1:] != group[:-1])])


def _likely_nodes(run: NDArray[np.int64], d: int) -> NDArray[np.int64]:
    """(N,) runs of at most d rows, and rows of longer runs by themselves."""
    order = len(run)
    return by_first_row(np.where(np.bincount(run)[run] <= d, run, order + np.arange(order)))


def directions_node_by_node(matrix: sp.csr_array, d: int, rounding: NDArray[np.float64]) -> NDArray[np.int64] | None:
    """(N,) the likeliest directions of rows that stand node by node, their sums rounded; None where no nodes show."""
    order = matrix.shape[0]
    nobody = np.zeros(order, dtype=bool)
    group = same_pattern(matrix, nobody)
    run = _runs(group)
    if 2 * np.count_nonzero(run_lengths(group) == d) <= order:
        return None
    node = _likely_nodes(run, d)
    return named_by_sums(matrix, run, find_directions(matrix, node, nobody, d, ordered=True), d, rounding)


def _by_pattern(matrix: sp.csr_array, group: NDArray[np.int64], run: NDArray[np.int64], d: int) -> Reading:
    """Nodes among runs of rows of the same pattern. Those of d rows are nodes, and tell directions of the others.

    Rows of longer runs, which hold several nodes, are taken one by one until directions tell where nodes end. Where
    sums do not prove all directions then, those of planes of rollers, and then equilibrium, name the rest.
    """
    order = len(run)
    nobody = np.zeros(order, dtype=bool)
    node = _likely_nodes(run, d)
    for _ in range(_ROUNDS):
        direction = find_directions(matrix, node, nobody, d, ordered=True)
        again = _cut_where(run, direction)
        if np.array_equal(again, node):
            break
        node = again
    unnamed = ~proven_directions(matrix, direction, group, d)
    if unnamed.any():
        direction = named_by_sums(matrix, run, direction, d)
        unnamed = ~proven_directions(matrix, direction, group, d)
    if unnamed.any():
        direction, unnamed = _in_equilibrium(matrix, group, direction, unnamed, d)
    if unnamed.any():
        direction, unnamed = _with_least_sums(matrix, group, direction, unnamed, d)
    return Reading(_cut_where(run, direction), direction, np.zeros(order, dtype=bool), unnamed)


def _in_equilibrium(
    matrix: sp.csr_array, group: NDArray[np.int64], direction: NDArray[np.int64], unnamed: NDArray[np.bool_], d: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Directions with which translations are in equilibrium, and rows whose direction no sum proves even then.

    They are likelier than those of least energy where no sum decides: along an edge in which planes meet, energy is
    lower yet with a wrong direction. Those given are kept if these contradict rows whose direction is proven, or leave
    more rows without a proof.
    """
    known = np.where(unnamed, -1, direction)
    other, share = extended_directions(matrix, group, np.ones(len(direction), dtype=bool), d, known=known)
    if share < WHOLE or (other != direction)[~unnamed].any():
        return direction, unnamed
    return _if_no_worse(matrix, group, other, (direction, unnamed), d)


def _with_least_sums(
    matrix: sp.csr_array, group: NDArray[np.int64], direction: NDArray[np.int64], unnamed: NDArray[np.bool_], d: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Directions with which sums are least, and rows without a proof, if these are no more.

    Material that is stiff against a change of volume has wrong directions of less energy along edges, and translations
    in equilibrium with these.
    """
    other = named_by_least_sums(matrix, direction, unnamed, d)
    return _if_no_worse(matrix, group, other, (direction, unnamed), d)


def _if_no_worse(
    matrix: sp.csr_array,
    group: NDArray[np.int64],
    direction: NDArray[np.int64],
    before: tuple[NDArray[np.int64], NDArray[np.bool_]],
    d: int,
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Directions, and rows without a proof; those `before` if these are fewer."""
    unnamed = ~proven_directions(matrix, direction, group, d)
    return (direction, unnamed) if np.count_nonzero(unnamed) <= np.count_nonzero(before[1]) else before


def _cut_where(run: NDArray[np.int64], direction: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N,) nodes that end with a run, or where directions stop increasing."""
    return np.concatenate([[0], np.cumsum((np.diff(run) > 0) | (np.diff(direction) <= 0))])


def told_by_likeness(matrix: sp.csr_array, d: int) -> list[Reading]:
    """Three readings where entries that vanished are not stored.

    Neighbouring rows that reach the same rows are taken for one node to find directions by; then a node ends where
    directions stop increasing. In the second reading each row has chosen its direction for itself in the end, since
    rows of two nodes taken for one would keep different ones for ever. In the third, directions have been found once
    more, from those of whole nodes, which order leaves no choice: next to edges where symmetry planes meet, several
    nodes that lack a direction may agree on a wrong one.
    """
    if matrix.shape[0] < 2 * d:
        return []
    nobody = np.zeros(matrix.shape[0], dtype=bool)
    reached = reach(matrix)
    if next_to_likest(matrix, reached) < _IN_TURN:
        return []
    node, link = stretches(reached, d)
    for _ in range(_ROUNDS):
        directions = find_directions(matrix, node, nobody, d)
        again = _increasing(matrix, reached, directions, link)
        if np.array_equal(again, node):
            break
        node = again
    freely = reconsidered(matrix, directions, d)
    other = _increasing(matrix, reached, freely, link)
    found = [(_mended(matrix, *one, d), one[1]) for one in ((node, directions), (other, freely))]
    third = find_directions(matrix, found[0][0], nobody, d, ordered=True)
    found.append((_mended(matrix, _increasing(matrix, reached, third, link), third, d), third))
    return [Reading(*one, unnamed=~proven_directions(matrix, one[1], one[0], d)) for one in found]


def _mended(matrix: sp.csr_array, node: NDArray[np.int64], direction: NDArray[np.int64], d: int) -> NDArray[np.int64]:
    """Join neighbouring runs where one lacks, without a trace, the direction of the row with which the other meets it.

    Its row has to stand next to it, in the order of directions, so that this is no guess: the two look little alike for
    other reasons.
    """
    everywhere = np.ones(len(node), dtype=bool)
    while True:
        lost = unaccounted(matrix, everywhere, node, direction, d)
        cut = np.diff(node) > 0
        joins = cut & (np.diff(direction) > 0)
        joins &= lost[node[:-1], direction[1:]] | lost[node[1:], direction[:-1]]
        if not joins.any():
            return node
        node = np.concatenate([[0], np.cumsum(cut & ~joins)])


def stretches(reached: sp.csr_array, d: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Runs of at most d rows, cut where neighbouring rows are least alike, and how alike each is to the next.

    Complete nodes have one cut in d places; that many weakest links are cut at least.

    Parameters
    ----------
    reached : (N, N) sparse
        See :func:`.likeness.reach`.
    d : int

    Returns
    -------
    node : (N,) int64
    link : (N - 1,) float64
    """
    row = np.arange(reached.shape[0] - 1)
    link = alike(reached, row, row + 1)
    cut = link < min(np.quantile(link, 1 / d) + 1e-9, doubtful(np.sort(link)[len(link) // d :]))
    while True:
        node = np.concatenate([[0], np.cumsum(cut)])
        size = np.bincount(node)
        if size.max() <= d:
            return node, link
        inner = ~cut & (size[node[:-1]] > d)
        weakest = np.full(len(size), np.inf)
        np.minimum.at(weakest, node[:-1][inner], link[inner])
        cut = cut | (inner & (link <= weakest[node[:-1]]))


def _increasing(
    matrix: sp.csr_array, reached: sp.csr_array, direction: NDArray[np.int64], link: NDArray[np.float64]
) -> NDArray[np.int64]:
    """(N,) runs of rows with increasing directions.

    Two rows that are less alike than nearly all others of these are cut apart unless each is the other's likest.
    """
    cut = np.diff(direction) <= 0
    weak = np.flatnonzero(~cut & (link < doubtful(link[~cut])))
    if len(weak):
        pattern = sp.csr_array((np.ones(matrix.nnz, np.float32), matrix.indices, matrix.indptr), shape=matrix.shape)
        both = likest(pattern, reached, weak, weak + 1, direction) & likest(pattern, reached, weak + 1, weak, direction)
        cut[weak[~both]] = True
    return np.concatenate([[0], np.cumsum(cut)])
