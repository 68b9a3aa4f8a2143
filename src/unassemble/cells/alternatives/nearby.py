"""Readings that differ by one cell or two from the one found, where vanished sides are supposed.

Points of a grid stand in such relations that a vertex may have two places between neighbours that stay where they
are, one with a right angle on one side of it, one with a right angle on the other.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...matrix import OperatorMatrix
from ...topology import Numbering, components
from ...topology.embedding import face_complexes
from ...topology.faces import FaceComplex, from_rotation
from ..agreement import SAME_SCALE
from ..alike import Cells
from ..candidates.candidates import Candidates
from ..labels.descent import as_good
from ..reading import NEARLY, Reading
from .corners import Alternative, OrientedMesh
from .cracks import cracked
from .rereading import cells_of, own_cells, with_vanished_sides

_MOST_VERTICES = 1000  # the cost grows like the square


def nearby_readings(
    stored: OperatorMatrix, mesh: OrientedMesh, factors: NDArray, scale: float | None, agree: float
) -> list[Alternative]:
    """Another reading of each component that has one, up to 1,000 rows, and unless entries have errors.

    Parameters are those of :func:`unassemble.cells.alternatives.ambiguity.alternatives`.
    """
    if stored.errors is not None and agree > NEARLY:
        return []
    half = with_vanished_sides(stored, mesh)
    if not half.any():
        return []
    parts = [
        part
        for part in components(stored.n, stored.edges)
        if len(part.vertices) <= _MOST_VERTICES and half[part.vertices].any()
    ]
    others = []
    for part, own in zip(parts, own_cells(stored.n, parts, mesh), strict=True):
        as_found = _as_found(stored, part, own, mesh.z, scale)
        if as_found is None:
            continue
        reading, usual = as_found
        c = float(factors[part.vertices[0]])
        for other in as_good(reading, reading.candidates.corner | reading.candidates.half, usual):
            if (cells := cells_of(other, part)) != own and not cracked(other):
                factor = next(solved.scale for solved in other.meshes if solved)
                same = abs(factor / c - 1) < max(SAME_SCALE, agree)
                others.append(Alternative.of(own, cells, same_scale=same))
                break
    return others


def _as_found(
    stored: OperatorMatrix, part: Numbering, own: Cells, z: NDArray[np.complex128], scale: float | None
) -> tuple[Reading[Candidates], NDArray[np.bool_]] | None:
    """The reading that was found, among the candidates of a drawing; None where no drawing has its cells.

    With what is a candidate in nearly any search, (cells,) bool; all that may be a cell would make very many pairs.
    """
    rows = {int(row): k for k, row in enumerate(part.vertices)}
    cells = {tuple(sorted(rows[row] for row in cell)) for cell in own}  # as candidates are named
    weights = -stored.entries[part.edge_rows]
    errors = None if stored.errors is None else stored.errors[part.edge_rows]
    for drawing in _drawings(part, z[part.vertices]):
        candidates = first = Candidates.of(drawing, weights, scale, errors=errors)
        labels = _labels(candidates, cells)
        if labels is None:
            candidates = Candidates.of(drawing, weights, scale, errors=errors, wide=True)
            labels = _labels(candidates, cells)
        reading = None if labels is None else Reading.of(candidates, labels)
        if reading is not None and reading.fits and cells_of(reading, part) == own:
            return reading, reading.labels | (first.numbers_of(candidates) >= 0)
    return None


def _drawings(part: Numbering, z: NDArray[np.complex128]) -> Iterator[FaceComplex]:
    """The mesh as it lies, and, as parts that hang by a vertex may lie on others, all drawings of the graph."""
    n, edges = len(part.vertices), part.edges
    tail, head = np.concatenate([edges, edges[:, ::-1]]).T
    order = np.lexsort((np.angle(z[head] - z[tail]), tail))
    drawing = from_rotation(n, edges, tail[order], head[order])
    if drawing.is_sphere():
        yield drawing
    yield from face_complexes(n, edges)


def _labels(candidates: Candidates, cells: Cells) -> NDArray[np.bool_] | None:
    """The candidates that cells are, or that they are put together of; None if there are none of some."""
    names = [name for name, _ in candidates.names]
    number = {name: k for k, name in enumerate(names)}
    labels = np.zeros(candidates.count, dtype=bool)
    for cell in cells:
        if cell in number:
            labels[number[cell]] = True
            continue
        inside, left = set(cell), len(cell) - 2  # triangles
        for k in sorted(np.flatnonzero(candidates.size < len(cell)), key=lambda k: -len(names[k])):
            if inside.issuperset(names[k]) and len(names[k]) - 2 <= left:
                labels[k], left = True, left - len(names[k]) + 2
        if left:
            return None
    return labels
