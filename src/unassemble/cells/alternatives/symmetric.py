"""Symmetries of the matrix that are none of the mesh.

Let a permutation of the rows leave the matrix as it is. With its rows renamed a mesh has the same matrix, and is
another one unless its cells are the same ones. So of a mesh that is the only one every symmetry of the matrix is a
symmetry: twins, rows with the same neighbours and the same entries, can have no cells of their own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...matrix import OperatorMatrix
from ...topology import Polygons
from ...topology.symmetries import symmetries
from ..alike import Cells, as_cell
from .corners import Alternative, OrientedMesh


def symmetric(stored: OperatorMatrix, mesh: OrientedMesh, agree: float) -> list[Alternative]:
    """Meshes with rows renamed that have the same matrix, and other cells."""
    found = []
    for rows, images in symmetries(stored.n, stored.edges, stored.entries, agree):
        cells = _cells_at(rows, mesh)
        name = dict(zip(rows.tolist(), images.tolist(), strict=True))
        renamed = {as_cell([name.get(row, row) for row in cell]) for cell in cells}
        if renamed == cells:
            continue
        if len(rows) == 2:
            gone, new = tuple(sorted(cells - renamed)), tuple(sorted(renamed - cells))
            pair = (int(rows[0]), int(rows[1]))
            found.append(Alternative(_around(stored, rows), pair, pair[::-1], gone, new))
        else:
            found.append(Alternative.of(cells, renamed, same_scale=True))
    return found


def _around(stored: OperatorMatrix, rows: NDArray[np.int64]) -> tuple[int, ...]:
    """The rows that some are joined to, without themselves."""
    near = stored.edges[np.isin(stored.edges, rows).any(axis=1)]
    return tuple(np.setdiff1d(near, rows).tolist())


def _cells_at(rows: NDArray[np.int64], mesh: OrientedMesh) -> Cells:
    """The cells that have any of some rows as a corner."""
    triangles = mesh.triangles[np.isin(mesh.triangles, rows).any(axis=1)].tolist()
    return {as_cell(cell) for cell in triangles + _polygons_at(rows, mesh.polygons)}


def _polygons_at(rows: NDArray[np.int64], polygons: Polygons) -> list[list[int]]:
    owner = np.repeat(np.arange(polygons.count), polygons.size)
    near = np.unique(owner[np.isin(polygons.vertices, rows)])
    return [polygons.vertices[polygons.offsets[k] : polygons.offsets[k + 1]].tolist() for k in near]
