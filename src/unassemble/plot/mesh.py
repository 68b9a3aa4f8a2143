"""The mesh itself on an axes: fill, edges, boundary loops, marks."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..words import count_of
from . import style
from .ink import ink

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

# Above this many edges an image replaces lines: quicker, smaller, and it shows density where lines would be a blot.
_MOST_LINES = 60_000
_MOST_VECTOR_LINES = 20_000


def draw_mesh(
    ax: Axes,
    points: NDArray,
    triangles: NDArray,
    outline: NDArray,
    boundary: NDArray,
    offsets: NDArray,
    outer: NDArray,
) -> list[Line2D]:
    """Draw a mesh; handles for a legend come back.

    Parameters
    ----------
    ax : Axes
        With its limits set.
    points : (n, 2) float64
    triangles : (m, 3) int64
        Neighbours run along a common edge in opposite directions.
    outline : (m, 3) bool
        Sides, from each corner to the next, that are drawn.
    boundary, offsets
        As in :class:`unassemble.Recovery`.
    outer : (loops,) bool
        Which loops bound a piece from outside, see :func:`outer_loops`.
    """
    from matplotlib.collections import LineCollection

    tail = triangles.ravel()
    head = triangles[:, [1, 2, 0]].ravel()
    once = (
        tail < head
    ) & outline.ravel()  # neighbours run along their edge in opposite directions; boundary edges come by themselves
    start, stop = points[tail[once]], points[head[once]]
    if not len(start):
        return []
    rings = [points[boundary[a:b, 0]] for a, b in pairwise(offsets)]
    _fill(ax, rings)
    width = _line_width(ax, start, stop)
    if len(start) > _MOST_LINES:
        _draw_ink(ax, start, stop, width)
    else:
        lines = LineCollection(
            list(np.stack([start, stop], axis=1)), colors=style.EDGE, linewidths=width, capstyle="round"
        )
        lines.set_rasterized(len(start) > _MOST_VECTOR_LINES)
        ax.add_collection(lines, autolim=False)
    for is_outer, colour in ((False, style.HOLE), (True, style.OUTER)):
        chosen = [np.vstack([ring, ring[:1]]) for ring, flag in zip(rings, outer, strict=True) if flag == is_outer]
        ax.add_collection(
            LineCollection(chosen, colors=colour, linewidths=np.clip(3 * width, 0.9, 1.4), joinstyle="round"),
            autolim=False,
        )
    n_holes = int(np.count_nonzero(~outer))
    return [line_handle(style.OUTER, "outer boundary")] + (
        [line_handle(style.HOLE, count_of(n_holes, "hole"))] if n_holes else []
    )


def draw_hinges(ax: Axes, points: NDArray, hinges: NDArray, count: int) -> list[Line2D]:
    """Mark vertices that join pieces; in a drawing, `count` of them may have become more."""
    if not len(hinges):
        return []
    x, y = points[hinges].T
    marks: dict[str, Any] = {
        "marker": "D",
        "color": style.HINGE,
        "markeredgecolor": style.OUTER,
        "markeredgewidth": 0.7,
    }
    ax.plot(x, y, linestyle="none", markersize=5.5, zorder=5, **marks)
    from matplotlib.lines import Line2D

    label = count_of(count, "hinge")
    return [Line2D([], [], linestyle="none", markersize=5, label=label, **marks)]


def draw_worst(ax: Axes, points: NDArray, pairs: NDArray) -> list[Line2D]:
    """Mark the entries of the matrix that fit worst, as edges with a ring around."""
    from matplotlib.collections import LineCollection

    ends = points[pairs]
    ends = ends[np.isfinite(ends).all(axis=(1, 2))] if len(pairs) else np.empty((0, 2, 2))
    if not len(ends):
        return []
    lines = LineCollection(list(ends), colors=style.WORST, linewidths=1.8, capstyle="round", zorder=6)
    ax.add_collection(lines, autolim=False)
    x, y = _apart(ends.mean(axis=1), 0.03 * float(np.ptp(ax.get_xlim()))).T
    ax.plot(x, y, "o", markersize=17, fillstyle="none", color=style.WORST, markeredgewidth=1.1, zorder=6)
    return [line_handle(style.WORST, "entries that fit worst", width=2.2)]


def _apart(points: NDArray, distance: float) -> NDArray:
    """Those of a few points that are not near an earlier one: neighbours share a ring."""
    gap = np.linalg.norm(points[:, None] - points[None], axis=2)
    return points[~np.tril(gap < distance, -1).any(axis=1)]


def line_handle(colour: str, label: str, width: float = 1.6) -> Line2D:
    """A short line for a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], color=colour, linewidth=width, label=label)


def extent(points: NDArray, triangles: NDArray) -> NDArray[np.float64]:
    """(2, 2) corners of the box around the mesh."""
    used = points[triangles.ravel()]
    used = used[np.isfinite(used).all(axis=1)]
    return np.stack([used.min(axis=0), used.max(axis=0)]) if len(used) else np.array([[0.0, 0.0], [1.0, 1.0]])


def outer_loops(points: NDArray, boundary: NDArray, offsets: NDArray) -> NDArray[np.bool_]:
    """(loops,) whether a boundary loop runs counter-clockwise; with cells that do, holes run clockwise."""
    loop = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    origin = points[boundary[offsets[:-1], 0]][loop]
    a, b = points[boundary[:, 0]] - origin, points[boundary[:, 1]] - origin
    area = np.bincount(loop, a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], len(offsets) - 1)
    return np.asarray(area > 0)


def _fill(ax: Axes, rings: list[NDArray]) -> None:
    """The domain as one path: holes run the other way round and stay empty."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    vertices = np.concatenate([np.vstack([ring, ring[:1]]) for ring in rings])
    codes = np.full(len(vertices), Path.LINETO, dtype=np.uint8)
    ends = np.cumsum([len(ring) + 1 for ring in rings])
    codes[np.append(0, ends[:-1])] = Path.MOVETO
    codes[ends - 1] = Path.CLOSEPOLY
    ax.add_patch(PathPatch(Path(vertices, codes), facecolor=style.FILL, edgecolor="none"))


def _line_width(ax: Axes, start: NDArray, stop: NDArray) -> float:
    """In points; a small part of a typical edge, so that fine meshes do not drown in ink."""
    line = stop - start
    box = ax.get_window_extent()
    pixels = np.median(np.hypot(line[:, 0], line[:, 1])) * box.width / np.ptp(ax.get_xlim())
    return float(np.clip(0.045 * pixels * 72 / ax.figure.dpi, 0.22, 0.6))


def _draw_ink(ax: Axes, start: NDArray, stop: NDArray, width: float) -> None:
    from matplotlib.colors import to_rgb

    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    # The image is made for the resolution at which figures are written, whatever the screen's.
    scale = style.DPI / ax.figure.dpi
    box = ax.get_window_extent()
    shape = (max(round(box.height * scale), 1), max(round(box.width * scale), 1))
    low, high = np.array([left, bottom]), np.array([right, top])
    length = ink(start, stop, low, high, shape)
    # Lines as wide as elsewhere, but thinner where most of the picture would be covered: shades then show density.
    covered = length * min(width * style.DPI / 72, 0.6 / float(np.median(length[length > 0])))
    picture = np.empty((*shape, 4), dtype=np.float32)
    picture[..., :3] = to_rgb(style.EDGE)
    picture[..., 3] = 1 - np.exp(-covered)
    ax.imshow(picture, extent=(left, right, bottom, top), origin="lower", zorder=1.5, aspect="equal")
