"""Domains of rows whose directions agree among themselves, but not with those of other domains.

A row that adds up to zero, direction by direction, vouches for all the rows that it touches: their directions agree, up
to the names of the axes. Domains are what such rows tie together. Within one, names can be exchanged only all at once;
rows that none vouches for are free.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

_MOST = 100  # domains of a cluster
_PATIENCE = 12  # changes in a row that do not lead below what they started from
_CLUSTERS = 50
_TINY = 1e-12  # of a row: no entry
GAIN = 1e-3  # of one sum that vanishes: what counts as a gain


def cost(sums: NDArray[np.float64]) -> NDArray[np.float64]:
    """What sums of entries, relative to their row, cost: nothing if zero, one at most, and concave in between.

    Rows next to supports never add up to zero, whatever their neighbours' directions, and should have no say; and one
    large sum is more likely than several small ones.
    """
    return np.asarray(np.sqrt(np.minimum(np.abs(sums), 1)))


@dataclass(frozen=True, eq=False)
class Sums:
    """A matrix, and what its rows add up to by direction.

    Attributes
    ----------
    matrix : (N, N) sparse
    scale : (N,) float64
        One over the size of each row.
    value : (N, d) float64
        Relative to that size.
    good : (N,) bool
        Rows that vouch for what they touch.
    """

    matrix: sp.csr_array
    scale: NDArray[np.float64]
    value: NDArray[np.float64]
    good: NDArray[np.bool_]


def clusters(sums: Sums, group: NDArray[np.int64], live: NDArray[np.bool_]) -> list[list[NDArray[np.int64]]]:
    """Coupled domains apart from the largest one, as lists of their rows.

    Parameters
    ----------
    sums : Sums
    group : (N,) int64
        Rows of one group belong to one node.
    live : (N,) bool
        Rows that count.
    """
    domain = _domains(sums, group)
    main = int(np.argmax(np.bincount(domain[live])))
    rest = np.flatnonzero(live & (domain != main))
    if not len(rest):
        return []
    name, inner = np.unique(domain[rest], return_inverse=True)
    onto = sp.csr_array((np.ones(len(rest)), (inner, np.arange(len(rest)))), shape=(len(name), len(rest)))
    label = sp.csgraph.connected_components(onto @ abs(sums.matrix[rest][:, rest]) @ onto.T, directed=False)[1]
    kept = np.flatnonzero(np.bincount(label) <= _MOST)[:_CLUSTERS]
    return [[rest[inner == k] for k in np.flatnonzero(label == one)] for one in kept]


def _domains(sums: Sums, group: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N,) domain of each row; groups that no good row vouches for are domains by themselves.

    It takes entries in all rows of a node but one, whose direction follows.
    """
    n = int(group.max()) + 1
    touched = sums.matrix.tocoo()
    live = sums.good[touched.row] & (np.abs(touched.data) * sums.scale[touched.row] > _TINY)
    ends = (touched.row[live], group[touched.col[live]])
    count = sp.coo_array((np.ones(len(ends[0]), np.int64), ends), shape=(len(group), n)).tocsr().tocoo()
    needed = np.maximum(np.bincount(group) - 1, 1)
    told = count.data >= needed[count.col]
    link = sp.csr_array(
        (np.ones(told.sum(), np.int8), (count.row[told] + n, count.col[told])), shape=(n + len(group),) * 2
    )
    return np.asarray(sp.csgraph.connected_components(link, directed=False)[1][group], dtype=np.int64)


def rearranged(
    sums: Sums,
    cluster: list[NDArray[np.int64]],
    group: NDArray[np.int64],
    direction: NDArray[np.int64],
    names: list[NDArray[np.int64]],
) -> NDArray[np.int64] | None:
    """Directions with those of a cluster exchanged, if more sums vanish then; see Kernighan and Lin (1970).

    One domain after the other takes the directions that cost least, even if they cost more than the ones before, and
    keeps them; of all stages the best counts.
    """
    rows = np.concatenate(cluster)
    touched = np.unique(sums.matrix[rows].indices)
    choices = [_choices(one, group, direction, names) for one in cluster]
    moves = [(k, choice) for k, some in enumerate(choices) for choice in some]
    if not moves:
        return None
    domain = np.array([k for k, _ in moves])
    which, row, step = _steps(sums, touched, [cluster[k] for k in domain], [choice for _, choice in moves], direction)
    local = sums.value[touched]
    total = float(cost(local).sum())
    best, stage, taken = total - GAIN, 0, []
    left = np.ones(len(moves), dtype=bool)
    while left.any():
        more = (cost(local[row] + step) - cost(local[row])).sum(axis=1)
        change = np.where(left, np.bincount(which, more, minlength=len(moves)), np.inf)
        chosen = int(np.argmin(change))
        total += float(change[chosen])
        taken.append(chosen)
        local[row[which == chosen]] += step[which == chosen]
        left &= domain != domain[chosen]
        if total < best:
            best, stage = total, len(taken)
        if len(taken) > stage + _PATIENCE:
            break
    if not stage:
        return None
    direction = direction.copy()
    for chosen in taken[:stage]:
        direction[cluster[domain[chosen]]] = moves[chosen][1]
    return direction


def _steps(
    sums: Sums,
    touched: NDArray[np.int64],
    rows: list[NDArray[np.int64]],
    choices: list[NDArray[np.int64]],
    direction: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """What the sums of touched rows change by when one set of rows after the other takes other directions.

    Returns
    -------
    which : (m,) int64
        The set of rows, increasing.
    row : (m,) int64
        Place of the row among those touched.
    step : (m, d) float64
    """
    d = sums.value.shape[1]
    block = sp.csc_array(sp.diags_array(sums.scale[touched]) @ sums.matrix[touched])
    which, row, steps = [np.empty(0, np.int64)], [np.empty(0, np.int64)], [np.empty((0, d))]
    for k, (some, choice) in enumerate(zip(rows, choices, strict=True)):
        change = block[:, some] @ (np.eye(d)[choice] - np.eye(d)[direction[some]])
        here = np.flatnonzero(change.any(axis=1))
        which.append(np.full(len(here), k))
        row.append(here)
        steps.append(change[here])
    return np.concatenate(which), np.concatenate(row), np.concatenate(steps)


def _choices(
    rows: NDArray[np.int64], group: NDArray[np.int64], direction: NDArray[np.int64], names: list[NDArray[np.int64]]
) -> NDArray[np.int64]:
    """(c, k) other directions that the rows of a domain may have."""
    if len(np.unique(group[rows])) == 1:
        every = names[len(rows) - 1]
    else:
        every = np.array([np.array(one)[direction[rows]] for one in permutations(range(len(names)))])
        if len(names[-1]) == 1:  # directions increase within a node
            same = group[rows[1:]] == group[rows[:-1]]
            every = every[(~same | (np.diff(every, axis=1) > 0)).all(axis=1)]
    return every[(every != direction[rows]).any(axis=1)]
