"""Cells in fans of triangles."""

import numpy as np
from numpy.typing import NDArray

from ...topology.keys import contains, pair_keys, runs
from ..candidates.candidates import Candidates


def triangulated(candidates: Candidates, labels: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(m, 3) triangles of the chosen cells, longer ones in fans.

    The apex of a fan moves on where a diagonal would be an edge already, of the graph or of another cell.
    """
    n, shift = candidates.n_vertices, np.zeros(candidates.count, dtype=np.int64)
    given = candidates.edges[:, 0] * n + candidates.edges[:, 1]
    for _ in range(int(candidates.cells.size.max())):
        triangles, cell, diagonal = fans(candidates, labels, shift)
        # Each diagonal belongs to the triangle before it.
        key, owner = pair_keys(n, *triangles[diagonal][:, [2, 0]].T), cell[diagonal]
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


def fans(
    candidates: Candidates, labels: NDArray[np.bool_], shift: NDArray[np.int64] | None = None
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
    """Triangles (m, 3) of cells in fans, the cell of each, and whether its last side is a diagonal.

    The apex of a fan is the vertex in place `shift`, (cells,), the first one by default.
    """
    cells = np.flatnonzero(labels)
    owner, step = runs(candidates.cells.size[cells] - 2)
    cell = cells[owner]
    start, length = candidates.cells.offsets[cell], candidates.cells.size[cell]
    corner = np.column_stack([np.zeros_like(step), step + 1, step + 2])
    if shift is not None:
        corner = (corner + shift[cell][:, None]) % length[:, None]
    return candidates.cells.vertices[start[:, None] + corner], cell, step + 1 < length - 2
