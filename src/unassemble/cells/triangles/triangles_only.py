"""Graphs all of whose edges lie on 3-cycles: nothing need have vanished, and only holes are to be found.

Corners and undivided cells are not supposed where triangles can do without them. Where triangles are cut off from the
others by holes, or hang on them by vertices, their numbers tell c, and by that many cells and holes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...topology import Polygons
from ...topology.cycles import three_cycles
from ...topology.embedding import face_complexes
from ..candidates.candidates import Candidates
from ..candidates.cell_set import CellSet
from ..labels.effort import Effort
from ..labels.mending import MOST_VERTICES
from ..reading import Reading
from .clusters import with_clusters
from .peeling import ContradictionError, peeled, scales_of_lone_triangles


def read_triangles(n: int, edges: NDArray, weights: NDArray, scale: float | None, effort: Effort) -> Reading | None:
    """Triangles that fit; None where none are found, or some edge lies on no triangle.

    Parameters are those of :func:`unassemble.cells.search.read_cells`.
    """
    if n > MOST_VERTICES:
        return None
    _, opposite = three_cycles(n, edges)
    scales = scales_of_lone_triangles(opposite, weights) if scale is None else [scale]
    possible = covered(opposite, weights) and scales
    drawing = next(face_complexes(n, edges), None) if possible else None
    if drawing is None:
        return None
    candidates = Candidates.of(drawing, weights, scale)
    labels, sides = candidates.triangles, candidates.triangle_sides
    if not covered(sides, weights):
        return None
    for c in scales:
        try:
            known = peeled(sides, 2 * weights / c)
            break
        except ContradictionError:
            continue
    else:
        return None
    start = candidates.cells.offsets[:-1][labels]
    triangles = candidates.cells.vertices[start[:, None] + np.arange(3)]
    reading = effort.reading(*_alone(n, edges, weights, c, triangles[known.state >= 0]))
    if not (reading.fits or reading.like_noise or known.state.all()):
        cells = with_clusters(triangles, sides, edges, weights, c, known)
        if cells is not None:
            reading = effort.reading(*_alone(n, edges, weights, c, cells))
    return reading if reading.fits else None


def _alone(n: int, edges: NDArray, weights: NDArray, c: float, triangles: NDArray) -> tuple[CellSet, NDArray[np.bool_]]:
    """Some triangles, and that all are cells."""
    none = np.zeros(len(triangles), dtype=bool)
    cells = Polygons(np.arange(0, 3 * len(triangles) + 1, 3), triangles.ravel())
    return CellSet(n, edges, weights, c, cells, none), ~none


def covered(sides: NDArray[np.int64], weights: NDArray[np.float64]) -> bool:
    """Whether each nonzero weight is that of a side of some triangle."""
    return not weights[np.bincount(sides.ravel(), minlength=len(weights)) == 0].any()
