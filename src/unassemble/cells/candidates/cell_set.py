"""Cells that a weighted graph may have, as far as a labelling of it needs them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...topology import Polygons


@dataclass(frozen=True, eq=False)
class CellSet:
    """Cells of a weighted graph.

    Attributes
    ----------
    n_vertices : int
    edges : (e, 2) int64
        Pairs i < j in lexicographic order.
    weights : (e,) float64
        -A_ij of each edge.
    scale : float or None
        c, where it is known.
    cells : Polygons
    corner : (cells,) bool
        Triangles a-b-c of two edges a-b, b-c; the third has vanished from the boundary, which it does if the angle at b
        is a right one.
    errors : (e,) float64 or None
        Standard deviations of the errors of the weights, where they are known.
    """

    n_vertices: int
    edges: NDArray[np.int64]
    weights: NDArray[np.float64]
    scale: float | None
    cells: Polygons
    corner: NDArray[np.bool_]
    errors: NDArray[np.float64] | None = field(default=None, kw_only=True)

    @property
    def count(self) -> int:
        """Number of cells."""
        return self.cells.count

    @property
    def size(self) -> NDArray[np.int64]:
        """(cells,) number of vertices."""
        return self.cells.size
