"""Where pieces are drawn: side by side where their own frames would put them on top of each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .pieces import Pieces, apart, together

if TYPE_CHECKING:
    from ..recovery import PlanarMesh

_MOST_COMPARED = 64
_SAMPLE = 400


@dataclass(frozen=True, eq=False)
class Drawing:
    """A mesh for the eye: its points are numbered anew where pieces that meet in a vertex are drawn apart.

    Attributes
    ----------
    points : (k, 2) float64
    triangles : (m, 3) int64
        Polygons divided.
    outline : (m, 3) bool
        Sides, from each corner to the next, that are none of their diagonals.
    boundary : (b, 2) int64
    offsets : (loops + 1,) int64
    hinges : (h,) int64
    pairs : (p, 2) int64
        Ends of the worst entries.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    outline: NDArray[np.bool_]
    boundary: NDArray[np.int64]
    offsets: NDArray[np.int64]
    hinges: NDArray[np.int64]
    pairs: NDArray[np.int64]


def drawing_of(recovery: PlanarMesh) -> Drawing:
    """Lay out the pieces of a mesh.

    Pieces of which any two overlap are shifted side by side; pieces that meet in hinges are kept together unless
    they overlap each other. Where nothing overlaps, as with known positions, all stay where they are.
    """
    triangles, outline = recovery.divided()
    drawing = Drawing(
        recovery.points,
        triangles,
        outline,
        recovery.boundary,
        recovery.boundary_offsets,
        recovery.hinges,
        recovery.worst_entries,
    )
    if recovery.n_components < 2:
        return drawing
    pieces = apart(recovery, triangles) if len(recovery.hinges) else together(recovery, triangles)
    renumbered = Drawing(
        recovery.points[pieces.vertices],
        pieces.triangles,
        outline,
        pieces.boundary,
        recovery.boundary_offsets,
        pieces.hinges,
        pieces.pairs,
    )
    low, high = _boxes(renumbered.points, pieces.piece, pieces.count)
    overlap = _overlaps(renumbered, pieces, low, high)
    if not overlap.any():
        return drawing
    unit = _units(pieces.group, overlap)
    low, high = _boxes(renumbered.points, np.where(pieces.piece >= 0, unit[pieces.piece], -1), int(unit.max()) + 1)
    shift = (_shelves(high - low) - low)[unit[pieces.piece]]
    return replace(renumbered, points=renumbered.points + np.where(pieces.piece[:, None] >= 0, shift, 0))


def _boxes(points: NDArray, label: NDArray, count: int) -> tuple[NDArray, NDArray]:
    """Lower left and upper right corners (count, 2) of the points with each label; negative labels are left out."""
    used = label >= 0
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, label[used], points[used])
    np.maximum.at(high, label[used], points[used])
    return low, high


def _overlaps(drawing: Drawing, pieces: Pieces, low: NDArray, high: NDArray) -> NDArray[np.bool_]:
    """(count, count) whether some triangle of one piece lies in the other, judged by centroids."""
    overlap = np.zeros((pieces.count, pieces.count), dtype=bool)
    if pieces.count > _MOST_COMPARED:  # so many are rarely placed by anchors, and comparing all pairs takes long
        return ~overlap
    meet: NDArray = np.all((low[:, None] < high[None]) & (high[:, None] > low[None]), axis=2)
    np.fill_diagonal(meet, False)
    owner = pieces.of_triangle
    for a in range(pieces.count):
        mine = np.flatnonzero(owner == a)
        sample = drawing.points[drawing.triangles[mine[:: max(len(mine) // _SAMPLE, 1)]]].mean(axis=1)
        for b in np.flatnonzero(meet[a]).tolist():
            overlap[a, b] = _inside(sample, drawing, pieces.piece, b).any()
    return overlap | overlap.T


def _inside(sample: NDArray, drawing: Drawing, piece: NDArray, b: int) -> NDArray:
    """Which points lie in piece b: within an odd number of its loops."""
    from matplotlib.path import Path

    inside = np.zeros(len(sample), dtype=bool)
    for start, stop in pairwise(drawing.offsets):
        if piece[drawing.boundary[start, 0]] == b:
            inside ^= Path(drawing.points[drawing.boundary[start:stop, 0]]).contains_points(sample)
    return inside


def _units(group: NDArray, overlap: NDArray) -> NDArray[np.int64]:
    """Label of what moves as one: a group of joined pieces, or each of its pieces if they overlap."""
    a, b = np.nonzero(overlap)
    split = np.zeros(int(group.max()) + 1, dtype=bool)
    split[group[a[group[a] == group[b]]]] = True
    own = len(split) + np.arange(len(group))
    return np.unique(np.where(split[group], own, group), return_inverse=True)[1]


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
