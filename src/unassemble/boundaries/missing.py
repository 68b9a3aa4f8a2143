"""Edges of matrices with replaced rows, where zeros are not stored."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ..matrix import OperatorMatrix
from ..topology.cycles import three_cycles
from ..topology.keys import contains, distinct, pair_keys
from ..words import count_of


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
    return _with_zeros(matrix, added)


def with_diagonals(matrix: OperatorMatrix, *, everywhere: bool = False) -> OperatorMatrix:
    """The same with zeros on one diagonal of each cell of four rows, whose diagonals both vanish: it is a rectangle.

    Where rows were replaced all edges but those between two of these have triangles on both sides, so that cells are
    missing, and not holes, where they do not. Else only on request, and holes of four edges count as cells.
    """
    if matrix.replaced is None and not everywhere:
        return matrix
    n, edges = matrix.n, matrix.edges
    gone = np.zeros(n, dtype=bool) if matrix.replaced is None else matrix.replaced
    _, opposite = three_cycles(n, edges)
    replaced = gone[edges].all(axis=1)
    opened = np.bincount(opposite.ravel(), minlength=len(edges)) < np.where(replaced, 1, 2)
    ends = edges[opened]
    graph = sp.coo_array((np.ones(len(ends), np.int32), ends.T), shape=(n, n)).tocsr()
    graph = graph + graph.T
    across = sp.triu(graph @ graph, 1).tocoo()
    pairs = np.column_stack([across.row, across.col])[across.data == 2].astype(np.int64)
    pairs = pairs[~contains(pair_keys(n, *edges.T), pair_keys(n, *pairs.T))]
    absent = {frozenset(pair) for pair in pairs.tolist()}
    added: list[tuple[int, int]] = []
    for a, c in pairs[~gone[pairs].all(axis=1)].tolist():
        other = frozenset(set(_around(graph, a)) & set(_around(graph, c)))
        if other in absent:
            absent.discard(frozenset((a, c)))  # its cell is divided
            added.append((a, c))
    if not added:
        return matrix
    note = (
        f"{count_of(len(added), 'cell has', 'cells have')} four corners on one circle: entries on both diagonals "
        "vanish, and which of them divides it is arbitrary"
    )
    return replace(_with_zeros(matrix, added), warnings=(*matrix.warnings, note))


def _with_zeros(matrix: OperatorMatrix, added: list[tuple[int, int]]) -> OperatorMatrix:
    """The same with zeros stored for these pairs of rows."""
    given = pair_keys(matrix.n, *matrix.edges.T)
    keys = distinct(np.concatenate([given, pair_keys(matrix.n, *np.array(added).T)]))
    entries = np.zeros(len(keys))
    entries[np.searchsorted(keys, given)] = matrix.entries
    return replace(matrix, edges=np.column_stack(np.divmod(keys, matrix.n)), entries=entries)


def _around(graph: sp.csr_array, row: int) -> list[int]:
    return graph.indices[graph.indptr[row] : graph.indptr[row + 1]].tolist()
