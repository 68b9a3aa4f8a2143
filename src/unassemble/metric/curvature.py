"""What the lengths say about bending."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .lengths import angles
from .mesh import SurfaceMesh


def curvatures(mesh: SurfaceMesh, squared: NDArray) -> NDArray[np.float64]:
    """(n,) what the angles about each vertex lack of 2 pi, or of pi on the boundary; NaN at vertices of no triangle.

    Where several sheets touch in a vertex, by edges or fans, theirs are added up. With v - e + m the Euler
    characteristic, and b = 2 e - 3 m the number of boundary edges, the sum over all vertices of a piece is
    2 pi v - pi b - pi m = 2 pi (v - e + m): Gauss and Bonnet, whatever the lengths.

    Parameters
    ----------
    mesh : SurfaceMesh
    squared : (e,) float64
        Squared edge lengths.
    """
    total = np.bincount(mesh.triangles.ravel(), angles(squared[mesh.opposite]).ravel(), mesh.n)
    _, one = np.unique(mesh.fan, return_index=True)
    fans = np.bincount(mesh.triangles.ravel()[one], minlength=mesh.n)
    on_boundary = np.bincount(mesh.edges[mesh.boundary].ravel(), minlength=mesh.n)
    defect = 2 * np.pi * fans - np.pi / 2 * on_boundary - total
    return np.where(fans > 0, defect, np.nan)
