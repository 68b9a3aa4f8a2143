"""Rows of the identity, which hold the places of those they replaced in an order component by component.

What they couple to does not say where they belong, but the order does: between two nodes that are known there are as
many rows of one direction as of another, and they go together one by one, unless others were eliminated besides.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..rows.grouping import without_doubles
from .matching import Pairs


class Places(NamedTuple):
    """Where rows stand in a matrix of which those of the identity were left out.

    Attributes
    ----------
    at : (N,) int64
        Increasing.
    order : int
        Of the whole matrix.
    """

    at: NDArray[np.int64]
    order: int


def joined_by_place(
    places: Places,
    group: NDArray[np.int64],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    d: int,
    open_row: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Nodes after open rows were joined whose places go together, and rows that are still open.

    Parameters
    ----------
    places : Places
    group, node, direction : (N,) int64
        Pattern, node and direction of each row; directions increase.
    d : int
    open_row : (N,) bool
        Rows that may belong to one node with others of their pattern.

    Returns
    -------
    node : (N,) int64
    open_row : (N,) bool
    """
    if len(places.at) == places.order or not open_row.any():
        return node, open_row
    row_of = np.full((int(node.max()) + 1, d), -1)
    row_of[node, direction] = np.arange(len(node))
    told = row_of[node] >= 0
    pairs = [np.empty((2, 0), dtype=np.int64)]
    for c, b in combinations(range(d), 2):
        (r, s), of_c, of_b = _one_by_one(places, group, row_of, direction, c, b)
        told[of_c, b] = told[of_b, c] = True
        both = open_row[r] & open_row[s]
        pairs.append(np.stack([r[both], s[both]]))
    return _linked(node, direction, d, np.hstack(pairs)), open_row & ~told.all(axis=1)


def _one_by_one(
    places: Places, group: NDArray, row_of: NDArray, direction: NDArray, c: int, b: int
) -> tuple[Pairs, NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of rows of two directions that go together, and all rows of each direction of which it is known.

    They are those between nodes that have both directions, where there are as many rows of each, those of the identity
    among them, and no two come together that couple to different unknowns.
    """
    none = np.empty(0, dtype=np.int64)
    known = row_of[(row_of[:, [c, b]] >= 0).all(axis=1)][:, [c, b]]
    known = known[np.argsort(known[:, 0])]
    if (np.diff(known[:, 1]) < 0).any():
        return (none, none), none, none
    border = np.stack([
        np.concatenate([[first], places.at[known[:, k]], [last]])
        for k, (first, last) in enumerate(_ends(places, direction, a) for a in (c, b))
    ])  # fmt: skip
    count = np.diff(border, axis=1)
    equal = (count[0] == count[1]) & (border[:, :-1] >= -1).all(axis=0) & (border[:, 1:] <= places.order).all(axis=0)
    rows, piece, offset = [], [], []
    for k, a in enumerate((c, b)):
        own = np.setdiff1d(np.flatnonzero(direction == a), known[:, k])
        at = np.searchsorted(border[k], places.at[own]) - 1
        own, at = own[equal[at]], at[equal[at]]
        rows.append(own)
        piece.append(at)
        offset.append(places.at[own] - border[k, at])
    live = sum(np.bincount(at, minlength=len(equal)) for at in piece)
    good = live < 2 * (count[0] - 1)
    one, other = (at * (places.order + 1) + off for at, off in zip(piece, offset, strict=True))
    _, here, there = np.intersect1d(one, other, assume_unique=True, return_indices=True)
    good[piece[0][here[group[rows[0][here]] != group[rows[1][there]]]]] = False
    kept = good[piece[0][here]]
    pairs = rows[0][here[kept]], rows[1][there[kept]]
    return pairs, rows[0][good[piece[0]]], rows[1][good[piece[1]]]


def _ends(places: Places, direction: NDArray[np.int64], c: int) -> tuple[int, int]:
    """Places before the first and after the last row of a direction; beyond the matrix where they are not known.

    Between the last row of one direction and the first of the next some of the identity may be either's.
    """
    rows = np.flatnonzero(direction == c)
    if not len(rows):
        return -2, places.order + 1
    before = -1 if rows[0] == 0 else int(places.at[rows[0] - 1])
    after = places.order if rows[-1] == len(direction) - 1 else int(places.at[rows[-1] + 1])
    unknown_first = before >= 0 and before + 1 < places.at[rows[0]]
    unknown_last = after < places.order and after - 1 > places.at[rows[-1]]
    return (-2 if unknown_first else before), (places.order + 1 if unknown_last else after)


def _linked(node: NDArray[np.int64], direction: NDArray[np.int64], d: int, pairs: NDArray) -> NDArray[np.int64]:
    """(N,) nodes after pairs of rows were joined, but for those that would have two rows of a direction."""
    n = int(node.max()) + 1
    link = sp.csr_array((np.ones(pairs.shape[1], np.int8), (node[pairs[0]], node[pairs[1]])), shape=(n, n))
    label = sp.csgraph.connected_components(link, directed=False)[1][node].astype(np.int64)
    return without_doubles(label, node, direction, d)[0]
