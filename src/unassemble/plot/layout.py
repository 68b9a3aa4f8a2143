"""Where pieces are drawn: side by side where their own frames would put them on top of each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

if TYPE_CHECKING:
    from ..recovery import PlanarMesh


def laid_out(mesh: PlanarMesh) -> NDArray[np.float64]:
    """(n, 2) points of a mesh for the eye; what hangs together, by edges or in hinges, stays together."""
    triangles = mesh.divided()[0]
    sides = (triangles[:, [0, 0]].ravel(), triangles[:, 1:].ravel())
    graph = sp.coo_array((np.ones(len(sides[0]), np.int8), sides), shape=(mesh.n_points,) * 2)
    label = csgraph.connected_components(graph, directed=False)[1]
    used = np.unique(triangles)
    part = np.full(mesh.n_points, -1)
    part[used] = np.unique(label[used], return_inverse=True)[1]
    return apart(mesh.points, part)


def apart(points: NDArray[np.float64], part: NDArray[np.int64]) -> NDArray[np.float64]:
    """(n, 2) points, one part beside the other if the boxes around any two overlap; as they are where none do.

    Parts are numbered by `part`, (n,), which is negative for points of none.
    """
    count = int(part.max(initial=-1)) + 1
    if count < 2:
        return points
    used = (part >= 0) & np.isfinite(points).all(axis=1)
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, part[used], points[used])
    np.maximum.at(high, part[used], points[used])
    meet = np.all((low[:, None] < high) & (high[:, None] > low), axis=2)
    if not np.triu(meet, 1).any():
        return points
    size = np.maximum(high - low, 0)
    shift = (_shelves(size) - np.where(size > 0, low, 0))[part]
    return points + np.where(part[:, None] >= 0, shift, 0)


def _shelves(size: NDArray) -> NDArray:
    """Lower left corners (k, 2) of boxes in rows, tallest first, top row first, about as wide as a page."""
    gap = 0.06 * np.sqrt(size.prod(axis=1).max())
    box = size + gap
    order = np.argsort(-size[:, 1], kind="stable")
    width = max(float(box[:, 0].max()), 1.5 * float(np.sqrt(box.prod(axis=1).sum())))
    corner = np.zeros_like(size)
    x = top = 0.0
    shelf = float(box[order[0], 1])
    for k in order:
        if x > 0 and x + box[k, 0] > width:
            x, top, shelf = 0.0, top - shelf, float(box[k, 1])
        corner[k] = x, top - size[k, 1]
        x += float(box[k, 0])
    return corner
