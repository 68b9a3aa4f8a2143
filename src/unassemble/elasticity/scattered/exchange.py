"""Rows of one pattern told apart by entries that stay when two directions change places.

Between two nodes i and j the entries A^{cb}_ij and A^{bc}_ij differ by the integral of lambda - mu times
d_c phi_i d_b phi_j - d_b phi_i d_c phi_j. Where the material is homogeneous and one of the nodes lies inside, that is
zero by parts; where it varies, it is small. So of several rows of direction c that couple to the same unknowns, the one
of the same node as a row of direction b is the likest that row, each with the other's direction in its columns.

That says which rows are likely to be one node's, and proves nothing.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from ..rows.constants import ROUNDING, row_sizes
from ..rows.grouping import by_first_row
from .patterns import by_direction

# What the rows of a pattern cost, paired in the best way, over what they cost without one of the pairs. In boxes of all
# quadratic elements nine of ten pairs that are one node's leave less, those that are not 0.66 and more. A wrong pair
# costs no more than time, since elements have to show it.
_CLEAR = 0.6
_ROUNDS = 4


def fullest(
    matrix: sp.csr_array, live: NDArray[np.bool_], group: NDArray[np.int64], direction: NDArray[np.int64], d: int
) -> NDArray[np.int64]:
    """(g,) a direction of which each node of a pattern has a row, probably; -1 where there may be none.

    It has if no pattern near, its own among them, has fewer rows of that direction than of others. Where planes of all
    directions meet no direction is like that; then the most numerous one is the likeliest, unless there are as many
    rows of each: of the nodes in a corner any may lack any.

    Parameters
    ----------
    matrix : (N, N) sparse
        Entries that vanish are stored.
    live : (N,) bool
        Rows that count.
    group, direction : (N,) int64
        Pattern and direction of each row.
    d : int
    """
    count = by_direction(group[live], direction[live], d, int(group.max()) + 1)
    most = count.max(axis=1, keepdims=True)
    fewer = (count < most)[group] & live[:, None]
    pattern = sp.csr_array((np.ones(matrix.nnz), matrix.indices, matrix.indptr), shape=matrix.shape)
    near = np.zeros(count.shape, dtype=bool)
    near[group[live]] = (pattern @ fewer.astype(float) > 0)[live]
    proven = np.where(near, 0, count)
    even = ((count == most) | (count == 0)).all(axis=1)
    likely = np.where(even | (most[:, 0] == 0), -1, count.argmax(axis=1))
    return np.where(proven.max(axis=1) > 0, proven.argmax(axis=1), likely)


def exchanged(
    matrix: sp.csr_array,
    live: NDArray[np.bool_],
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    d: int,
    *,
    clearly: bool = True,
    apart: bool = True,
) -> NDArray[np.int64]:
    """(N,) nodes after rows of one pattern were joined that are likest each other with directions exchanged.

    Entries with whole nodes are compared; there are more of them the more rows are joined. In patterns in which no
    direction may be one of which each node has a row, pairs count that are likest both ways; there single rows of each
    direction, too, may be several nodes'.

    Parameters
    ----------
    matrix : (N, N) sparse
        Entries that vanish are stored.
    live : (N,) bool
        Rows that count.
    group : (N,) int64
        Rows that couple to the same unknowns.
    node, direction : (N,) int64
        Rows of patterns with several rows of some direction stand alone.
    d : int
    clearly : bool
        Whether to join only rows that any others would be clearly less like.
    apart : bool
        Whether to take rows apart that may be several nodes' though there is but one of each direction.
    """
    count = by_direction(group[live], direction[live], d, int(group.max()) + 1)
    several: NDArray[np.bool_] = np.asarray((count > 1).any(axis=1))
    if not several.any():
        return node
    base = fullest(matrix, live, group, direction, d)
    if apart:
        node = by_first_row(np.where((base[group] < 0) & live, len(node) + np.arange(len(node)), node))
    rows = np.flatnonzero(several[group] & live)
    rows = rows[np.lexsort((direction[rows], group[rows]))]
    patterns = np.split(rows, np.flatnonzero(np.diff(group[rows])) + 1) if len(rows) else []
    for _ in range(_ROUNDS):
        label = node.copy()
        costs = _costs(matrix, group, node, direction, d, patterns)
        for members, cost in zip(patterns, costs, strict=True):
            of_all = int(base[group[members[0]]])
            if of_all < 0:
                first = _mutual(direction[members], cost)
            else:
                first = _paired(direction[members], cost, of_all, _CLEAR if clearly else 1.0)
            label[members] = len(node) + members[first]
        again = by_first_row(label)
        if np.array_equal(again, node):
            break
        node = again
    return node


def _costs(
    matrix: sp.csr_array,
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    d: int,
    patterns: list[NDArray[np.int64]],
) -> list[dict[tuple[int, int], NDArray[np.float64]]]:
    """How unlike rows of each pattern are: for directions c and b a matrix, by the columns of whole nodes."""
    row_of = np.full((int(node.max()) + 1, d), -1)
    row_of[node, direction] = np.arange(len(node))
    columns = row_of[(row_of >= 0).all(axis=1)]
    size = row_sizes(matrix)
    costs: list[dict[tuple[int, int], NDArray[np.float64]]] = [{} for _ in patterns]
    for c, b in combinations(range(d), 2):
        of_c, of_b = ([members[direction[members] == a] for members in patterns] for a in (c, b))
        r = np.concatenate([np.empty(0, np.int64), *(np.repeat(m, len(n)) for m, n in zip(of_c, of_b, strict=True))])
        s = np.concatenate([np.empty(0, np.int64), *(np.tile(n, len(m)) for m, n in zip(of_c, of_b, strict=True))])
        value = _unlike(matrix, size, r, s, columns[:, b], columns[:, c], group)
        start = 0
        for cost, m, n in zip(costs, of_c, of_b, strict=True):
            end = start + len(m) * len(n)
            cost[c, b] = value[start:end].reshape(len(m), len(n))
            cost[b, c] = cost[c, b].T
            start = end
    return costs


def _unlike(
    matrix: sp.csr_array,
    size: NDArray[np.float64],
    r: NDArray[np.int64],
    s: NDArray[np.int64],
    of_b: NDArray[np.int64],
    of_c: NDArray[np.int64],
    group: NDArray[np.int64],
) -> NDArray[np.float64]:
    """(k,) what rows r and s cost, NaN where no columns tell: those of their own pattern are what is to be decided.

    Sums of roots of differences: where most entries agree a few that do not weigh less than many small differences.
    """
    one, other = sp.csr_array(matrix[r][:, of_b]), sp.csr_array(matrix[s][:, of_c])
    apart = sp.coo_array(one - other)
    value = np.abs(apart.data) / np.sqrt(size[r] * size[s])[apart.row]
    telling = (value > ROUNDING) & (group[of_b][apart.col] != group[r][apart.row])
    cost = np.bincount(apart.row, np.sqrt(value) * telling, minlength=len(r))
    known = sp.coo_array(one)
    shared = np.bincount(known.row, group[of_b][known.col] != group[r][known.row], minlength=len(r))
    return np.where(shared > 0, cost, np.nan)


def _paired(
    direction: NDArray[np.int64], cost: dict[tuple[int, int], NDArray[np.float64]], base: int, most: float
) -> NDArray[np.int64]:
    """(k,) for each row of a pattern the place of the first row of its node.

    Rows of direction `base` are nodes, to which those of the other directions are added, the most numerous first, where
    that costs less than `most` times what it would cost in any other way.
    """
    rows = {int(a): np.flatnonzero(direction == a) for a in np.unique(direction)}
    first = np.arange(len(direction))
    nodes = [{base: k} for k in range(len(rows[base]))]
    for b in sorted((a for a in rows if a != base), key=lambda a: -len(rows[a])):
        unlike = np.array([np.mean([cost[c, b][k] for c, k in one.items()], axis=0) for one in nodes])
        for i, j in _assigned(unlike, most):
            nodes[i][b] = j
            first[rows[b][j]] = rows[base][nodes[i][base]]
    return first


def _mutual(direction: NDArray[np.int64], cost: dict[tuple[int, int], NDArray[np.float64]]) -> NDArray[np.int64]:
    """The same of rows that are clearly likest both ways, where no direction tells how many nodes there are."""
    ends = [np.empty((2, 0), np.int64)]
    for (c, b), unlike in cost.items():
        if c < b and min(unlike.shape) > 1 and not np.isnan(unlike).any():
            next_b, next_c = np.partition(unlike, 1, axis=1)[:, 1], np.partition(unlike, 1, axis=0)[1]
            found = np.nonzero(unlike < _CLEAR * np.minimum(next_b[:, None], next_c))
            ends.append(np.stack([np.flatnonzero(direction == a)[some] for a, some in zip((c, b), found, strict=True)]))
    r, s = np.hstack(ends)
    link = sp.csr_array((np.ones(len(r), np.int8), (r, s)), shape=(len(direction),) * 2)
    label = sp.csgraph.connected_components(link, directed=False)[1]
    twice = np.asarray((by_direction(label, direction, int(direction.max()) + 1) > 1).any(axis=1))[label]
    _, first, inverse = np.unique(np.where(twice, -1 - np.arange(len(label)), label), return_index=True,
                                  return_inverse=True)  # fmt: skip
    return np.asarray(first[inverse], dtype=np.int64)


def _assigned(cost: NDArray[np.float64], most: float) -> list[tuple[int, int]]:
    """Pairs of the assignment of least cost, less than `most` times what it would cost without the pair."""
    if np.isnan(cost).any():
        return []
    i, j = linear_sum_assignment(cost)
    least, never = float(cost[i, j].sum()), 1 + 2 * float(cost.sum())
    found = []
    for k in range(len(i)):
        other = cost.copy()
        other[i[k], j[k]] = never
        if least < most * float(other[linear_sum_assignment(other)].sum()):
            found.append((int(i[k]), int(j[k])))
    return found
