"""Where pieces are drawn: side by side where their own frames would put them on top of each other."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

if TYPE_CHECKING:
    from ..recovery import PlanarMesh


def laid_out(mesh: PlanarMesh) -> NDArray[np.float64]:
    """(n, 2) points of a mesh for the eye: of its parts, if any two overlap, one is put beside the other.

    A part is what hangs together, by edges or in hinges. Where nothing overlaps, as with known positions, all stay.
    """
    triangles = mesh.divided()[0]
    part = _parts(mesh.n_points, triangles)
    count = int(part.max(initial=-1)) + 1
    if count < 2:
        return mesh.points
    low, high = _boxes(mesh.points, part, count)
    # More are rarely placed by anchors, and comparing all pairs takes long.
    if count <= 64 and not _overlap(mesh, triangles, part, low, high):
        return mesh.points
    shift = (_shelves(high - low) - low)[part]
    return mesh.points + np.where(part[:, None] >= 0, shift, 0)


def _parts(n: int, triangles: NDArray) -> NDArray[np.int64]:
    """Connected part of each point, -1 for points of no triangle."""
    sides = (triangles[:, [0, 0]].ravel(), triangles[:, 1:].ravel())
    graph = sp.coo_array((np.ones(len(sides[0]), np.int8), sides), shape=(n, n))
    label = csgraph.connected_components(graph, directed=False)[1]
    used = np.unique(triangles)
    part = np.full(n, -1)
    part[used] = np.unique(label[used], return_inverse=True)[1]
    return part


def _boxes(points: NDArray, label: NDArray, count: int) -> tuple[NDArray, NDArray]:
    """Lower left and upper right corners (count, 2) of the points with each label; negative labels are left out."""
    used = label >= 0
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, label[used], points[used])
    np.maximum.at(high, label[used], points[used])
    return low, high


def _overlap(mesh: PlanarMesh, triangles: NDArray, part: NDArray, low: NDArray, high: NDArray) -> bool:
    """Whether a triangle of one part lies in another, judged by the centroids of some 400 of each."""
    owner = part[triangles[:, 0]]
    meet: NDArray = np.all((low[:, None] < high[None]) & (high[:, None] > low[None]), axis=2)
    np.fill_diagonal(meet, False)
    for a, b in np.argwhere(meet).tolist():
        mine = triangles[owner == a]
        if _inside(mesh.points[mine[:: max(len(mine) // 400, 1)]].mean(axis=1), mesh, part, b).any():
            return True
    return False


def _inside(sample: NDArray, mesh: PlanarMesh, part: NDArray, b: int) -> NDArray[np.bool_]:
    """Which points lie in part b: within an odd number of its loops."""
    from matplotlib.path import Path

    inside = np.zeros(len(sample), dtype=bool)
    for start, stop in pairwise(mesh.boundary_offsets):
        if part[mesh.boundary[start, 0]] == b:
            inside ^= Path(mesh.points[mesh.boundary[start:stop, 0]]).contains_points(sample)
    return inside


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
