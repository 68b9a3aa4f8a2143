"""Bodies and structures as pictures: outer surfaces, shaded, planar cells, shells and members, or bare nodes."""

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..elements.surface import outer_facets, planar_outlines
from ..recovery import Recovery
from . import style
from .canvas import apart, panel
from .mesh import draw_lines, extent, line_handle

# Looking down on the body from the front and the right; z points up.
_ACROSS = np.array([0.80, 0.60, 0.0])
_TOWARDS = np.array([0.52, -0.69, 0.50]) / np.linalg.norm([0.52, -0.69, 0.50])
_LIGHT = np.array([0.25, -0.55, 0.80]) / np.linalg.norm([0.25, -0.55, 0.80])


def plot_body(recovery: Recovery, ax: Axes | None = None) -> tuple[Figure, list[Artist]]:
    """A body or structure, pieces side by side, and handles for the legend."""
    flat, depth = _projected(recovery.points)
    flat = apart(flat, recovery.component)
    known = np.asarray(np.isfinite(flat).all(axis=1))
    figure, ax = panel(extent(flat, known), ax)
    handles: list[Artist] = []
    if not recovery.n_cells:
        size = float(np.clip(120 / np.sqrt(max(known.sum(), 1)), 1, 4))
        ax.plot(*flat[known].T, "o", markersize=size, color=style.EDGE)
        handles.append(line_handle(style.EDGE, "nodes; no elements were recognised", width=3))
    faces = _faces(recovery)
    if faces:
        _draw_faces(ax, recovery, faces, flat, depth)
        outside = f"{'outer surface' if recovery.dim == 3 else 'boundary'} of the recognised cells"
        named = recovery.look.cells
        handles.append(line_handle(style.EDGE if named else style.OUTER, named or outside))
    lines = recovery.cells.get("line")
    if lines is not None:
        order = np.argsort(depth[lines].mean(axis=1), kind="stable")
        draw_lines(ax, flat[lines[order]], style.OUTER, float(np.clip(60 / np.sqrt(len(order)), 0.3, 1.6)))
        handles.append(line_handle(style.OUTER, "members"))
    elif len(recovery.boundary):
        draw_lines(ax, flat[recovery.boundary], style.OUTER, 1.2)
    return figure, handles


def _projected(points: NDArray) -> tuple[NDArray, NDArray]:
    """Picture coordinates (n, 2), and how near the eye each point is."""
    if points.shape[1] == 2:
        return points.copy(), np.zeros(len(points))
    across = _ACROSS / np.linalg.norm(_ACROSS)
    return points @ np.column_stack([across, np.cross(_TOWARDS, across)]), points @ _TOWARDS


def _faces(recovery: Recovery) -> list[NDArray]:
    """Polygons of nodes (m, k) to be filled; of bodies in space the outer facets that face the eye."""
    cells = {kind: cells for kind, cells in recovery.cells.items() if kind != "line"}
    if not recovery.look.solid:
        return list(cells.values())
    if recovery.dim == 2:
        return [planar_outlines(kind, some) for kind, some in cells.items()]
    return [some[_normals(recovery.points[some]) @ _TOWARDS > 0] for some in (outer_facets(cells) if cells else [])]


def _normals(corners: NDArray) -> NDArray:
    """(m, 3) unit normals of facets (m, k, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(normal / np.where(length > 0, length, 1))


def _draw_faces(ax: Axes, recovery: Recovery, faces: list[NDArray], flat: NDArray, depth: NDArray) -> None:
    """The farthest first."""
    order = np.argsort(np.concatenate([depth[some].mean(axis=1) for some in faces]), kind="stable")
    polygons = [polygon for some in faces for polygon in flat[some]]
    large = len(order) > style.MOST_VECTOR
    colours: NDArray | str = style.FILL
    edge = style.EDGE
    if recovery.look.shaded and recovery.dim == 3:
        normals = np.concatenate([_normals(recovery.points[some]) for some in faces])
        if recovery.look.two_sided:
            normals = normals * np.sign(normals @ _TOWARDS)[:, None]
        shade = 0.3 + 0.7 * np.clip(normals[order] @ _LIGHT, 0, 1)[:, None]
        colours = shade * np.array(to_rgb(style.FILL)) + (1 - shade) * np.array(to_rgb(style.EDGE))
        edge = "face" if large else style.OUTER
    width = float(np.clip(40 / np.sqrt(max(len(order), 1)), 0.1, 0.6))
    drawn: dict[str, Any] = {"facecolors": colours, "edgecolors": edge, "linewidths": width, "rasterized": large}
    ax.add_collection(PolyCollection([polygons[k] for k in order], **drawn), autolim=False)
