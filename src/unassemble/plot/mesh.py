"""The mesh itself on an axes: fill, edges, boundary loops, marks."""

from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray

from ..recovery import Recovery
from ..words import count_of
from . import style


def draw_mesh(ax: Axes, mesh: Recovery, points: NDArray, outer: NDArray) -> list[Line2D]:
    """Draw a mesh with its points at `points` (n, 2), on an axes with its limits set; handles for a legend come back.

    `outer`, (loops,) bool: which loops bound a piece from outside, see :func:`outer_loops`.
    """
    triangles, outline = mesh.divided()
    tail, head = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    # Neighbours run along their edge in opposite directions; boundary edges come by themselves.
    once = (tail < head) & outline.ravel()
    start, stop = points[tail[once]], points[head[once]]
    if not len(start):
        return []
    rings = [points[mesh.boundary[a:b, 0]] for a, b in pairwise(mesh.boundary_offsets)]
    _fill(ax, rings)
    # A small part of a typical edge, in points, so that fine meshes are shades and do not drown in ink.
    inches = ax.get_window_extent().width / ax.figure.dpi * np.median(np.linalg.norm(stop - start, axis=1))
    width = float(np.clip(0.045 * 72 * inches / np.ptp(ax.get_xlim()), 0.05, 0.6))
    draw_lines(ax, np.stack([start, stop], axis=1), style.EDGE, width, capstyle="round")
    for is_outer, colour in ((False, style.HOLE), (True, style.OUTER)):
        chosen = [np.vstack([ring, ring[:1]]) for ring, flag in zip(rings, outer, strict=True) if flag == is_outer]
        draw_lines(ax, chosen, colour, float(np.clip(3 * width, 0.9, 1.4)), joinstyle="round")
    n_holes = int(np.count_nonzero(~outer))
    holes = [line_handle(style.HOLE, count_of(n_holes, "hole"))] if n_holes else []
    return [line_handle(style.OUTER, "outer boundary"), *holes]


def draw_lines(ax: Axes, lines: Iterable[NDArray], colour: str, width: float, **more: Any) -> None:
    """Lines through points (k, 2) each."""
    lines = list(lines)
    drawn = LineCollection(lines, colors=colour, linewidths=width, rasterized=len(lines) > style.MOST_VECTOR, **more)
    ax.add_collection(drawn, autolim=False)


def draw_hinges(ax: Axes, points: NDArray) -> list[Line2D]:
    """Mark vertices (k, 2) that join pieces."""
    if not len(points):
        return []
    edge = {"markeredgecolor": style.OUTER, "markeredgewidth": 0.7}
    label = count_of(len(points), "hinge")
    return ax.plot(*points.T, "D", markersize=5.5, zorder=5, color=style.HINGE, label=label, **edge)  # type: ignore[arg-type]


def draw_worst(ax: Axes, points: NDArray, pairs: NDArray) -> list[Line2D]:
    """Mark the entries of the matrix that fit worst, as edges with a ring around."""
    ends = points[pairs]
    ends = ends[np.isfinite(ends).all(axis=(1, 2))]
    if not len(ends):
        return []
    draw_lines(ax, ends, style.WORST, 1.8, capstyle="round", zorder=6)
    ax.plot(
        *ends.mean(axis=1).T, "o", markersize=17, fillstyle="none", color=style.WORST, markeredgewidth=1.1, zorder=6
    )
    return [line_handle(style.WORST, "entries that fit worst", width=2.2)]


def line_handle(colour: str, label: str, width: float = 1.6) -> Line2D:
    """A short line for a legend."""
    return Line2D([], [], color=colour, linewidth=width, label=label)


def extent(points: NDArray, used: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(2, 2) corners of the box around the points in use."""
    used = points[used & np.isfinite(points).all(axis=1)]
    return np.stack([used.min(axis=0), used.max(axis=0)]) if len(used) else np.array([[0.0, 0.0], [1.0, 1.0]])


def outer_loops(mesh: Recovery) -> NDArray[np.bool_]:
    """(loops,) whether a boundary loop runs counter-clockwise, as outer ones do; around holes they run clockwise."""
    boundary, offsets = mesh.boundary, mesh.boundary_offsets
    loop = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    origin = mesh.points[boundary[offsets[:-1], 0]][loop]
    a, b = mesh.points[boundary[:, 0]] - origin, mesh.points[boundary[:, 1]] - origin
    return np.asarray(np.bincount(loop, a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], len(offsets) - 1) > 0)


def _fill(ax: Axes, rings: list[NDArray]) -> None:
    """The domain as one path: holes run the other way round and stay empty."""
    vertices = np.concatenate([np.vstack([ring, ring[:1]]) for ring in rings])
    codes = np.full(len(vertices), Path.LINETO, dtype=np.uint8)
    ends = np.cumsum([len(ring) + 1 for ring in rings])
    codes[np.append(0, ends[:-1])] = Path.MOVETO
    codes[ends - 1] = Path.CLOSEPOLY
    ax.add_patch(PathPatch(Path(vertices, codes), facecolor=style.FILL, edgecolor="none"))
