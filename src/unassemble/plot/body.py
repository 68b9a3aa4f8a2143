"""Bodies of vector-valued matrices as pictures: their outer surface, shaded, or planar cells, or bare nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import style
from .canvas import footer, header, panels
from .mesh import line_handle
from .structure import draw_structure

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..recovery import Recovery

# Looking down on the body from the front and the right; z points up.
_ACROSS = np.array([0.80, 0.60, 0.0])
_TOWARDS = np.array([0.52, -0.69, 0.50]) / np.linalg.norm([0.52, -0.69, 0.50])
_LIGHT = np.array([0.25, -0.55, 0.80]) / np.linalg.norm([0.25, -0.55, 0.80])
_MOST_OUTLINED = 40_000
_MOST_VECTOR = 5_000


def plot_body(recovery: Recovery, headline: str, details: str) -> Figure:
    """Draw the body of an elasticity matrix; pieces side by side.

    Parameters
    ----------
    recovery : Recovery
    headline, details : str
        Above the picture.
    """
    flat, depth = _projected(recovery.points)
    flat = _side_by_side(flat, recovery)
    known = np.isfinite(flat).all(axis=1)
    shown = flat[known] if known.any() else np.array([[0.0, 0.0], [1.0, 1.0]])
    figure, (ax,) = panels([np.stack([shown.min(axis=0), shown.max(axis=0)])])
    handles: list[Artist] = []
    if not recovery.n_cells:
        ax.plot(*shown.T, "o", markersize=float(np.clip(120 / np.sqrt(len(shown)), 1, 4)), color=style.EDGE)
        handles.append(line_handle(style.EDGE, "nodes; no elements were recognised", width=3))
    elif len(recovery.lines) or (recovery.dim == 3 and not (len(recovery.tetrahedra) or len(recovery.hexahedra))):
        handles += draw_structure(ax, recovery, flat, depth)
    elif recovery.dim == 3:
        _draw_surface(ax, recovery, flat, depth)
        handles.append(line_handle(style.OUTER, "outer surface of the recognised cells"))
    else:
        _draw_cells(ax, recovery, flat)
        handles.append(line_handle(style.OUTER, "boundary of the recognised cells"))
    header(figure, headline, details, style.STATUS.get(recovery.status, style.TEXT))
    footer(figure, handles)
    return figure


def _projected(points: NDArray) -> tuple[NDArray, NDArray]:
    """Picture coordinates (n, 2), and how near the eye each point is."""
    if points.shape[1] == 2:
        return points.copy(), np.zeros(len(points))
    across = _ACROSS / np.linalg.norm(_ACROSS)
    return points @ np.column_stack([across, np.cross(_TOWARDS, across)]), points @ _TOWARDS


def _side_by_side(flat: NDArray, recovery: Recovery) -> NDArray:
    """Each piece has its own frame: put them in a row."""
    left = 0.0
    for piece in range(recovery.n_components if recovery.n_components > 1 else 0):
        here = recovery.component == piece
        if not here.any():
            continue
        low, high = np.nanmin(flat[here], axis=0), np.nanmax(flat[here], axis=0)
        flat[here] += [left - low[0], -low[1]]
        left += 1.1 * (high[0] - low[0])
    return flat


def _draw_surface(ax: Axes, recovery: Recovery, flat: NDArray, depth: NDArray) -> None:
    """Facets that face the eye, the farthest first."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    from ..elements.surface import outer_facets

    polygons: list[NDArray] = []
    normals, away = [np.empty((0, 3))], [np.empty(0)]
    for facets in outer_facets(recovery.cells):
        x = recovery.points[facets]
        normal = np.cross(x[:, 1] - x[:, 0], x[:, -1] - x[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normal = normal / np.where(length > 0, length, 1)
        facing = normal @ _TOWARDS > 0
        polygons += list(flat[facets[facing]])
        normals.append(normal[facing])
        away.append(depth[facets[facing]].mean(axis=1))
    order = np.argsort(np.concatenate(away), kind="stable")
    shade = 0.3 + 0.7 * np.clip(np.concatenate(normals)[order] @ _LIGHT, 0, 1)[:, None]
    colours = shade * np.array(to_rgb(style.FILL)) + (1 - shade) * np.array(to_rgb(style.EDGE))
    ax.add_collection(
        PolyCollection(
            [polygons[k] for k in order],
            facecolors=colours,
            edgecolors=style.OUTER if len(polygons) <= _MOST_OUTLINED else "face",
            linewidths=float(np.clip(30 / np.sqrt(max(len(polygons), 1)), 0.1, 0.6)),
            rasterized=len(polygons) > _MOST_VECTOR,
        ),
        autolim=False,
    )


def _draw_cells(ax: Axes, recovery: Recovery, flat: NDArray) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    from ..elements.surface import planar_outlines

    for kind, cells in recovery.cells.items():
        ax.add_collection(
            PolyCollection(
                list(flat[planar_outlines(kind, cells)]),
                facecolors=style.FILL,
                edgecolors=style.EDGE,
                linewidths=float(np.clip(40 / np.sqrt(len(cells)), 0.15, 0.6)),
                rasterized=len(cells) > _MOST_VECTOR,
            ),
            autolim=False,
        )
    ax.add_collection(LineCollection(list(flat[recovery.boundary]), colors=style.OUTER, linewidths=1.2), autolim=False)
