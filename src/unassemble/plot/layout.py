"""Where pieces are drawn: side by side where their own frames would put them on top of each other."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

_MOST_COMPARED = 64
_SAMPLE = 400


def laid_out(points: NDArray, triangles: NDArray, boundary: NDArray, offsets: NDArray) -> NDArray[np.float64]:
    """Positions for a drawing.

    Parts of the mesh that share no vertex are shifted side by side if any two of them overlap; otherwise, as with
    known positions, all stay where they are.

    Parameters
    ----------
    points : (n, 2) float64
    triangles : (m, 3) int64
    boundary, offsets
        As in :class:`unassemble.Recovery`.
    """
    part = _parts(len(points), triangles)
    used = np.flatnonzero(part >= 0)
    n_parts = int(part.max(initial=-1)) + 1
    if n_parts < 2:
        return points
    low, high = np.full((n_parts, 2), np.inf), np.full((n_parts, 2), -np.inf)
    np.minimum.at(low, part[used], points[used])
    np.maximum.at(high, part[used], points[used])
    if not _overlap(points, triangles, boundary, offsets, part, low, high):
        return points
    placed = np.array(points)
    placed[used] += (_shelves(high - low) - low)[part[used]]
    return placed


def _parts(n: int, triangles: NDArray) -> NDArray:
    """Label of the vertex-connected part of each point, -1 for points of no triangle."""
    ones = np.ones(2 * len(triangles), np.int8)
    pairs = np.concatenate([triangles[:, :2], triangles[:, 1:]])
    graph = sp.csr_array((ones, pairs.T), shape=(n, n))
    label = csgraph.connected_components(graph, directed=False)[1]
    used = np.zeros(n, dtype=bool)
    used[triangles] = True
    part = np.full(n, -1, dtype=np.int64)
    part[used] = np.unique(label[used], return_inverse=True)[1]
    return part


def _overlap(
    points: NDArray,
    triangles: NDArray,
    boundary: NDArray,
    offsets: NDArray,
    part: NDArray,
    low: NDArray,
    high: NDArray,
) -> bool:
    """Whether some triangle of one part lies in another part, judged by centroids."""
    if len(low) > _MOST_COMPARED:
        return True  # so many parts are rarely placed by anchors, and comparing all pairs would take long
    meet: NDArray = np.all((low[:, None] < high[None]) & (high[:, None] > low[None]), axis=2)
    np.fill_diagonal(meet, False)
    owner = part[triangles[:, 0]]
    for a in range(len(low)):
        mine = np.flatnonzero(owner == a)
        sample = points[triangles[mine[:: max(len(mine) // _SAMPLE, 1)]]].mean(axis=1)
        if any(_inside(sample, points, boundary, offsets, part, b).any() for b in np.flatnonzero(meet[a]).tolist()):
            return True
    return False


def _inside(sample: NDArray, points: NDArray, boundary: NDArray, offsets: NDArray, part: NDArray, b: int) -> NDArray:
    """Which points lie in part b: within an odd number of its loops."""
    from matplotlib.path import Path

    inside = np.zeros(len(sample), dtype=bool)
    for start, stop in pairwise(offsets):
        if part[boundary[start, 0]] == b:
            inside ^= Path(points[boundary[start:stop, 0]]).contains_points(sample)
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
