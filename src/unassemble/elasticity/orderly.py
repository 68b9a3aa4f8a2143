"""Unknowns that stand in order, node by node or component by component, but some of which were taken out.

Rollers and symmetry planes eliminate single directions of nodes. No stride fits the rest, but its order says much:
node by node, directions increase within each node; component by component, the directions are d stretches of the
rows, with nodes in the same order in each.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .directions import find_directions, reconsidered
from .grouping import by_first_row
from .likeness import alike, doubtful, partners, reach

_ROUNDING = 1e-9
_STEPS = 2
_ROUNDS = 3


def by_component(matrix: sp.csr_array, d: int) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Nodes and directions of rows that stand direction by direction; none where no such order shows.

    Parameters
    ----------
    matrix : (N, N) sparse
        Columns increasing in each row.
    d : int

    Returns
    -------
    list of (node, direction), (N,) int64 each
    """
    cuts = _cuts(matrix, d)
    if cuts is None:
        return []
    direction = np.searchsorted(cuts, np.arange(matrix.shape[0]), side="right")
    return [(matched_in_order(matrix, direction, d), direction)]


def _cuts(matrix: sp.csr_array, d: int) -> NDArray[np.int64] | None:
    """(d - 1,) first rows of all directions but the first.

    A row that annihilates constants direction by direction does so up to each cut: sums over its first columns vanish
    there. Each row votes for all places between two of its columns where they do.
    """
    order = matrix.shape[0]
    size = np.add.reduceat(np.abs(matrix.data), matrix.indptr[:-1])
    row = np.repeat(np.arange(order), np.diff(matrix.indptr))
    partial = _running_sums(matrix)
    inner = np.ones(matrix.nnz, dtype=bool)
    inner[matrix.indptr[1:] - 1] = False
    whole = np.abs(partial[matrix.indptr[1:] - 1]) <= _ROUNDING * size
    place = np.flatnonzero(inner & whole[row] & (np.abs(partial) <= _ROUNDING * size[row]))
    first, last = matrix.indices[place] + 1, matrix.indices[place + 1] + 1
    cuts: list[int] = []
    for _ in range(d - 1):
        votes = np.cumsum(np.bincount(first, minlength=order + 2) - np.bincount(last, minlength=order + 2))
        if votes.max() <= 0:
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


def matched_in_order(matrix: sp.csr_array, direction: NDArray[np.int64], d: int) -> NDArray[np.int64]:
    """(N,) nodes of rows whose directions are known and whose nodes stand in the same order in each direction."""
    order = matrix.shape[0]
    reached = reach(matrix, _STEPS)
    pattern = sp.csr_array((np.ones(matrix.nnz, np.float32), matrix.indices, matrix.indptr), shape=matrix.shape)
    rows = [np.flatnonzero(direction == a) for a in range(d)]
    first, second = [], []
    for c, b in combinations(range(d), 2):
        if len(rows[c]) and len(rows[b]):
            r, s = _aligned(pattern, reached, rows[c], rows[b])
            first.append(r)
            second.append(s)
    if not first:
        return np.arange(order)
    link = sp.csr_array(
        (np.ones(sum(map(len, first))), (np.concatenate(first), np.concatenate(second))), shape=(order, order)
    )
    label = sp.csgraph.connected_components(link, directed=False)[1]
    # Rows of the same direction cannot share a node: chains of contradicting pairs come apart.
    key = label.astype(np.int64) * d + direction
    twice = np.bincount(key)[key] > 1
    torn = np.bincount(label, twice)[label] > 0
    return by_first_row(np.where(torn, order + np.arange(order), label))


def _aligned(
    pattern: sp.csr_array, reached: sp.csr_array, rows_c: NDArray, rows_b: NDArray
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of rows of two directions: the likest both ways, in increasing order; what fits in between is added."""
    r, s, value = partners(pattern, reached, rows_c, rows_b)
    kept = np.flatnonzero(_as_many(r, s, len(rows_c), len(rows_b)))
    kept = kept[_longest_increasing(r[kept], s[kept])]
    r, s = r[kept], s[kept]
    if not len(r):
        return rows_c[r], rows_b[s]
    least = doubtful(value[kept])
    # Between two pairs as many rows of one direction as of the other: they are the same nodes, in order.
    r = np.concatenate([[-1], r, [len(rows_c)]])
    s = np.concatenate([[-1], s, [len(rows_b)]])
    gap = np.diff(r) - 1
    fits = (gap > 0) & (gap == np.diff(s) - 1)
    step = np.arange(gap[fits].sum()) - np.repeat(np.cumsum(gap[fits]) - gap[fits], gap[fits]) + 1
    more_r, more_s = np.repeat(r[:-1][fits], gap[fits]) + step, np.repeat(s[:-1][fits], gap[fits]) + step
    found = np.concatenate([rows_c[r[1:-1]], rows_c[more_r]]), np.concatenate([rows_b[s[1:-1]], rows_b[more_s]])
    sure = alike(reached, *found) >= least
    return found[0][sure], found[1][sure]


def _as_many(r: NDArray[np.int64], s: NDArray[np.int64], n_c: int, n_b: int) -> NDArray[np.bool_]:
    """(k,) pairs among rows equally alike of which there are as many in both directions.

    Where one direction has a row less, order does not tell which of the other's lacks it.
    """
    link = sp.csr_array((np.ones(len(r), np.int8), (r, n_c + s)), shape=(n_c + n_b,) * 2)
    label = sp.csgraph.connected_components(link, directed=False)[1]
    as_many = np.bincount(label[:n_c], minlength=label.max() + 1) == np.bincount(label[n_c:], minlength=label.max() + 1)
    return np.asarray(as_many[label[r]])


def _longest_increasing(r: NDArray[np.int64], s: NDArray[np.int64]) -> NDArray[np.int64]:
    """Places of a longest subset of pairs with both r and s strictly increasing (patience sorting)."""
    from bisect import bisect_left

    order = np.lexsort((-s, r))  # of several partners of one row at most one is taken
    ends: list[int] = []
    at: list[int] = []
    before = np.full(len(r), -1)
    for place in order.tolist():
        k = bisect_left(ends, int(s[place]))
        if k == len(ends):
            ends.append(int(s[place]))
            at.append(place)
        else:
            ends[k], at[k] = int(s[place]), place
        before[place] = at[k - 1] if k else -1
    chain = []
    place = at[-1] if at else -1
    while place >= 0:
        chain.append(place)
        place = int(before[place])
    return np.array(chain[::-1], dtype=np.int64)


def node_by_node(matrix: sp.csr_array, d: int) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Nodes and directions of rows that stand node by node, each with at most d rows: two readings.

    Neighbouring rows that reach the same rows are taken for one node to find directions by; then a node ends where
    directions stop increasing. In the second reading each row has chosen its direction for itself in the end, since
    rows of two nodes taken for one would keep different ones for ever.
    """
    order = matrix.shape[0]
    if order < 2 * d:
        return []
    nobody = np.zeros(order, dtype=bool)
    node, link = stretches(matrix, d)
    for _ in range(_ROUNDS):
        directions = find_directions(matrix, node, nobody, d)
        again = _increasing(directions, link)
        if np.array_equal(again, node):
            break
        node = again
    freely = reconsidered(matrix, directions, d)
    return [(node, directions), (_increasing(freely, link), freely)]


def stretches(matrix: sp.csr_array, d: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Runs of at most d rows, cut where neighbouring rows are least alike, and how alike each is to the next.

    Complete nodes have one cut in d places; that many weakest links are cut at least.

    Returns
    -------
    node : (N,) int64
    link : (N - 1,) float64
    """
    row = np.arange(matrix.shape[0] - 1)
    link = alike(reach(matrix, _STEPS), row, row + 1)
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


def _increasing(direction: NDArray[np.int64], link: NDArray[np.float64]) -> NDArray[np.int64]:
    """(N,) runs of rows with increasing directions, and not less alike than nearly all others of these."""
    cut = np.diff(direction) <= 0
    if not cut.all():
        cut |= link < doubtful(link[~cut])
    return np.concatenate([[0], np.cumsum(cut)])
