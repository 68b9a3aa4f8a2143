"""Edges between rows that were replaced, where their zeros are not stored."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..matrix import OperatorMatrix
from ..topology.cycles import three_cycles
from ..topology.keys import distinct, pair_keys


def with_boundary_edges(matrix: OperatorMatrix) -> OperatorMatrix:
    """The same with zeros between replaced rows that are neighbours around another row.

    A row that was not replaced lies inside, so that each edge there has triangles on both sides. Replaced neighbours
    of which a triangle is missing are joined: two that miss one each, or three of which the one in the middle misses
    both. Where more are missing their order is not known, and they are left as they are.
    """
    if matrix.replaced is None:
        return matrix
    n, edges = matrix.n, matrix.edges
    _, opposite = three_cycles(n, edges)
    missing = 2 - np.bincount(opposite.ravel(), minlength=len(edges))
    first = matrix.replaced[edges]
    short = np.flatnonzero((first.sum(axis=1) == 1) & (missing > 0))
    inside = np.where(first[short, 0], edges[short, 1], edges[short, 0])
    outside = edges[short].sum(axis=1) - inside
    around: dict[int, list[tuple[int, int]]] = {}
    for row, neighbour, count in zip(inside.tolist(), outside.tolist(), missing[short].tolist(), strict=True):
        around.setdefault(row, []).append((count, neighbour))
    added: list[tuple[int, int]] = []
    for ends in around.values():
        match sorted(ends):
            case [(1, a), (1, b)]:
                added.append((a, b))
            case [(1, a), (1, b), (2, middle)]:
                added += [(a, middle), (middle, b)]
    if not added:
        return matrix
    given = pair_keys(n, *edges.T)
    keys = distinct(np.concatenate([given, pair_keys(n, *np.array(added).T)]))
    entries = np.zeros(len(keys))
    entries[np.searchsorted(keys, given)] = matrix.entries
    return replace(matrix, edges=np.column_stack(np.divmod(keys, n)), entries=entries)
