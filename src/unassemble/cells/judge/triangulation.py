"""Cells divided into triangles, whichever diagonals these need."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...topology.keys import contains, pair_keys
from ..candidates.candidates import Candidates


def triangulation(candidates: Candidates, labels: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(m, 3) triangles of the chosen cells, longer ones in fans.

    The apex of a fan moves on where a diagonal would be an edge already, of the graph or of another cell.
    """
    n, shift = candidates.n_vertices, np.zeros(candidates.count, dtype=np.int64)
    given = candidates.edges[:, 0] * n + candidates.edges[:, 1]
    for _ in range(int(candidates.size.max())):
        triangles, cell, diagonal = _fans(candidates, labels, shift)
        key = _keys(n, triangles)[:, 1]  # each diagonal belongs to the triangle before it
        key, owner = key[diagonal], cell[diagonal]
        value, place, count = np.unique(key, return_inverse=True, return_counts=True)
        clash = contains(given, value) | (count > 1)
        if not clash.any():
            break
        moved = owner[clash[place]]
        # Of two cells that want the same diagonal one keeps it.
        keeps = np.unique(key[clash[place]], return_index=True)[1]
        moved = np.setdiff1d(moved, moved[keeps][count[clash] > 1])
        shift[moved] += 1
    return triangles


def _fans(candidates: Candidates, labels: NDArray, shift: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Triangles, the cell of each, and whether its last side is a diagonal."""
    cells = np.flatnonzero(labels)
    size = candidates.size[cells]
    cell = np.repeat(cells, size - 2)
    step = np.arange(len(cell)) - np.repeat(np.cumsum(size - 2) - (size - 2), size - 2) + 1
    start, length = candidates.cells.offsets[cell], candidates.size[cell]
    corner = (shift[cell][:, None] + np.column_stack([np.zeros_like(step), step, step + 1])) % length[:, None]
    return candidates.cells.vertices[start[:, None] + corner], cell, step < length - 2


def fans_of(candidates: Candidates, labels: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(m, 3) triangles of cells, each in a fan about its first vertex, and (m,) the cell of each."""
    triangles, cell, _ = _fans(candidates, labels, np.zeros(candidates.count, dtype=np.int64))
    return triangles, cell


def _keys(n: int, triangles: NDArray) -> NDArray[np.int64]:
    """(m, 3) keys i n + j, i < j, of the edges facing the corners."""
    ends = triangles[:, [[1, 2], [2, 0], [0, 1]]]
    return pair_keys(n, ends[..., 0], ends[..., 1])
