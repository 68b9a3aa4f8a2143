"""Symmetries of the matrix that are none of the mesh.

Let a permutation of the rows leave the matrix as it is. With its rows renamed a mesh has the same matrix, and is
another one unless its cells are the same ones. So of a mesh that is the only one every symmetry of the matrix is a
symmetry: twins, rows with the same neighbours and the same entries, can have no cells of their own.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from ...matrix import OperatorMatrix
from ...topology.symmetries import symmetries
from ..alike import Cells, as_cell
from .corners import Alternative, OrientedMesh


def symmetric(stored: OperatorMatrix, mesh: OrientedMesh, agree: float) -> list[Alternative]:
    """Meshes with rows renamed that have the same matrix, and other cells."""
    every = list(symmetries(stored.n, stored.edges, stored.entries, agree))
    moved = np.zeros(stored.n, dtype=bool)
    for rows, _ in every:
        moved[rows] = True
    cells_at, joined_to = defaultdict[int, Cells](set), defaultdict[int, set[int]](set)
    for corners in mesh.cells_at(moved):
        for row in corners:
            cells_at[row].add(as_cell(corners))
    for i, j in stored.edges[moved[stored.edges].any(axis=1)].tolist():
        joined_to[i].add(j)
        joined_to[j].add(i)
    found = []
    for rows, images in every:
        name = dict(zip(rows.tolist(), images.tolist(), strict=True))
        cells = set().union(*(cells_at[row] for row in name))
        renamed = {as_cell([name.get(row, row) for row in cell]) for cell in cells}
        if renamed == cells:
            continue
        if len(name) == 2:
            pair = tuple(name)
            around = tuple(sorted((joined_to[pair[0]] | joined_to[pair[1]]) - name.keys()))
            gone, new = tuple(sorted(cells - renamed)), tuple(sorted(renamed - cells))
            found.append(Alternative(around, pair, pair[::-1], gone, new))
        else:
            found.append(Alternative.of(cells, renamed, same_scale=True))
    return found
