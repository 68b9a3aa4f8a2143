"""Right angles of cells that might as well be cells by themselves.

Let a cell have a right angle at h, between the edges h-a and h-b. The triangle a-h-b gives both edges what the cell
does, and nothing to a-b: the rest of the cell fits without it. Corners, the third side of which has vanished from the
boundary, are such triangles; so are the halves of an undivided rectangle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...topology.faces import joined
from ...topology.keys import contains
from ..alike import as_cell
from .corners import Corners, OrientedMesh, cell

_RIGHT = 1e-6  # cosine of an angle that may be a right one, without noise

Cells = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class RightAngle:
    """One of them.

    Attributes
    ----------
    apex, first, second : int
        The vertex of the right angle and the ends of its sides, counter-clockwise.
    gets : float
        Logarithm of the cotangent that the first side gets; the second gets the inverse.
    cell : tuple of int
    rest : tuple of tuple of int
        What is left of a cell of more than three corners, in running order.
    """

    apex: int
    first: int
    second: int
    gets: float
    cell: tuple[int, ...]
    rest: Cells


def right_angles(n: int, edges: NDArray, mesh: OrientedMesh, corners: Corners, agree: float) -> list[list[RightAngle]]:
    """Those of each vertex that has several: all corners, and cells whose sides at the vertex border no other.

    Parameters
    ----------
    n : int
    edges : (e, 2) int64
        Stored ones, i < j.
    mesh : OrientedMesh
    corners : Corners
    agree : float
        Error of angles that noise may cause.
    """
    first, apex, second, polygon = _alone(n, edges, mesh, max(_RIGHT, agree))
    polygon = np.append(np.full(len(corners), -1), polygon)
    h, a, b = (np.append(*pair) for pair in ((corners.apex, apex), (corners.first, first), (corners.second, second)))
    # Lone corners are found in both ways.
    ends = np.sort(np.column_stack([a, b]), axis=1)
    _, once = np.unique(np.column_stack([h, ends]), axis=0, return_index=True)
    once = once[np.bincount(h[once], minlength=n)[h[once]] > 1]
    gets = np.log(np.abs(mesh.z[b] - mesh.z[h]) / np.abs(mesh.z[a] - mesh.z[h]))
    found: dict[int, list[RightAngle]] = {}
    for k in once.tolist():
        top, one, two = int(h[k]), int(a[k]), int(b[k])
        own = cell(top, frozenset((one, two)))
        rest: Cells = ()
        if polygon[k] >= 0:
            start, end = mesh.polygons.offsets[polygon[k] : polygon[k] + 2].tolist()
            outline = mesh.polygons.vertices[start:end].tolist()
            own, place = as_cell(outline), outline.index(top)
            rest = (as_cell((*outline[place + 1 :], *outline[:place])),)
        found.setdefault(top, []).append(RightAngle(top, one, two, float(gets[k]), own, rest))
    return list(found.values())


def _alone(n: int, edges: NDArray, mesh: OrientedMesh, error: float) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Right angles of cells both of whose sides there lie on the boundary: ends, the vertex between, and the polygon.

    -1 stands for a triangle.
    """
    t, size = mesh.triangles, mesh.polygons.size
    owner = np.repeat(np.arange(mesh.polygons.count), size)
    place = np.arange(len(owner)) - mesh.polygons.offsets[owner]
    before, after = (mesh.polygons.offsets[owner] + (place + step) % size[owner] for step in (-1, 1))
    v = mesh.polygons.vertices
    apex = np.append(t.ravel(), v)
    following = np.append(np.roll(t, -1, axis=1).ravel(), v[after])
    previous = np.append(np.roll(t, 1, axis=1).ravel(), v[before])
    polygon = np.append(np.full(t.size, -1), owner)
    # The boundary passes such a vertex once for each of them.
    chosen = np.flatnonzero((np.bincount(mesh.boundary[:, 0], minlength=n) > 1)[apex])
    outline = np.sort(mesh.boundary @ [n, 1])
    lone = contains(outline, apex[chosen] * n + following[chosen])
    chosen = chosen[lone & contains(outline, previous[chosen] * n + apex[chosen])]
    apex, following, previous, polygon = apex[chosen], following[chosen], previous[chosen], polygon[chosen]
    u, w = mesh.z[following] - mesh.z[apex], mesh.z[previous] - mesh.z[apex]
    right = np.abs((np.conj(u) * w).real) <= error * np.abs(u) * np.abs(w)
    # A stored third side that no other cell has would be left without any.
    bare = contains(outline, following * n + previous) & joined(n, edges, following, previous) & (polygon < 0)
    right &= ~bare
    return following[right], apex[right], previous[right], polygon[right]
