"""Members and shell cells as pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import style
from .mesh import line_handle

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from ..recovery import Structure

_MOST_VECTOR = 5_000


def draw_structure(ax: Axes, recovery: Structure, flat: NDArray, depth: NDArray) -> list[Artist]:
    """Draw shell cells, the farthest first, and the members over them.

    Parameters
    ----------
    ax : Axes
    recovery : Structure
    flat : (n, 2) float64
        Where nodes are in the picture.
    depth : (n,) float64
        How near the eye they are.

    Returns
    -------
    list of Artist
        For the legend.
    """
    from matplotlib.collections import LineCollection, PolyCollection

    handles: list[Artist] = []
    shells = [cells for kind, cells in recovery.cells.items() if kind != "line"]
    if shells:
        corners = [row for cells in shells for row in flat[cells]]
        order = np.argsort(np.concatenate([depth[cells].mean(axis=1) for cells in shells]), kind="stable")
        ax.add_collection(
            PolyCollection(
                [corners[k] for k in order],
                facecolors=style.FILL,
                edgecolors=style.EDGE,
                linewidths=float(np.clip(40 / np.sqrt(len(order)), 0.15, 0.8)),
                rasterized=len(order) > _MOST_VECTOR,
            ),
            autolim=False,
        )
        handles.append(line_handle(style.EDGE, "cells of shells or plates, read off the graph"))
    if len(recovery.lines):
        order = np.argsort(depth[recovery.lines].mean(axis=1), kind="stable")
        ax.add_collection(
            LineCollection(
                list(flat[recovery.lines[order]]),
                colors=style.OUTER,
                linewidths=float(np.clip(60 / np.sqrt(len(order)), 0.3, 1.6)),
                rasterized=len(order) > _MOST_VECTOR,
            ),
            autolim=False,
        )
        handles.append(line_handle(style.OUTER, "members"))
    return handles
