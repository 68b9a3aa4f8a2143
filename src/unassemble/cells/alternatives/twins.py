"""Rows with the same neighbours and the same entries: alike to the matrix, not always to the mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...matrix import OperatorMatrix
from ...topology import Polygons
from ..alike import Cells, as_cell
from .corners import Alternative, OrientedMesh


def twins(stored: OperatorMatrix, mesh: OrientedMesh, agree: float) -> list[Alternative]:
    """Pairs of rows with the same one or two neighbours and the same entries whose exchange makes other cells."""
    degree = np.bincount(stored.edges.ravel(), minlength=stored.n)
    ends = np.concatenate([stored.edges, stored.edges[:, ::-1]])
    entries = np.tile(stored.entries, 2)
    few = degree[ends[:, 0]] <= 2
    order = np.flatnonzero(few)[np.lexsort((ends[few, 1], ends[few, 0]))]
    row, neighbour, entry = ends[order, 0], ends[order, 1], entries[order]
    start = np.flatnonzero(np.diff(row, prepend=-1))
    last = np.append(start[1:], len(row))[: len(start)] - 1
    alike = np.lexsort((entry[last], entry[start], neighbour[last], neighbour[start]))
    start, last = start[alike], last[alike]
    same = (neighbour[start[1:]] == neighbour[start[:-1]]) & (neighbour[last[1:]] == neighbour[last[:-1]])
    for place in (start, last):
        same &= np.abs(entry[place[1:]] - entry[place[:-1]]) <= agree * np.abs(entry[place[1:]])
    pairs = [(int(row[start[k]]), int(row[start[k + 1]]), start[k], last[k]) for k in np.flatnonzero(same)]
    if not pairs:
        return []
    cells_at = _cells_at(np.unique([pair[:2] for pair in pairs]), mesh)
    found = []
    for x, y, one, other in pairs:
        cells = cells_at[x] | cells_at[y]
        renamed = {as_cell([{x: y, y: x}.get(v, v) for v in cell]) for cell in cells}
        if renamed != cells:
            around = tuple(sorted({int(neighbour[one]), int(neighbour[other])}))
            found.append(
                Alternative(around, (x, y), (y, x), tuple(sorted(cells - renamed)), tuple(sorted(renamed - cells)))
            )
    return found


def _cells_at(rows: NDArray, mesh: OrientedMesh) -> dict[int, Cells]:
    """The cells of each row."""
    cells_at: dict[int, Cells] = {row: set() for row in rows.tolist()}
    near = mesh.triangles[np.isin(mesh.triangles, rows).any(axis=1)].tolist() + _polygons_at(rows, mesh.polygons)
    for cell in near:
        for row in cell:
            if row in cells_at:
                cells_at[row].add(as_cell(cell))
    return cells_at


def _polygons_at(rows: NDArray, polygons: Polygons) -> list[list[int]]:
    owner = np.repeat(np.arange(polygons.count), polygons.size)
    near = np.unique(owner[np.isin(polygons.vertices, rows)])
    return [polygons.vertices[polygons.offsets[k] : polygons.offsets[k + 1]].tolist() for k in near]
