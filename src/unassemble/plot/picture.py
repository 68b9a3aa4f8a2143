"""A recovered mesh as a picture."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..clock import Clock
from ..metric import realised
from ..metric.result import Surface
from ..recovery import Body, Mechanical, PlanarMesh, Recovery
from ..summary import counted_cells, scale_text
from ..words import count_of
from . import style
from .body import plot_body
from .canvas import check_plot, footer, header, panels, write_figure
from .layout import laid_out
from .mesh import draw_hinges, draw_mesh, draw_worst, extent, outer_loops

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure


def plot_recovery(recovery: Recovery, path: str | os.PathLike[str] | None = None) -> Figure:
    """Draw a recovered mesh: cells, outer boundary, holes, hinges, and what fits worst if uncertified.

    Pieces whose frames overlap are drawn side by side. Points without coordinates are left out. Of bodies in space
    the outer surface is drawn, shaded. Surfaces that have edge lengths only are drawn in coordinates that come near
    these; the header says how near.

    Parameters
    ----------
    recovery : Recovery
    path : path, optional
        Write the picture there, whole or not at all: ``.png``, ``.svg`` or ``.pdf``.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    if path is not None:
        check_plot(path)
    if isinstance(recovery, Surface) and recovery.realisation is None:
        recovery = realised(recovery, Clock(), starts=1)  # edge lengths cannot be drawn
    figure, handles = planar_mesh(recovery) if isinstance(recovery, PlanarMesh) else plot_body(recovery)
    about = "edge lengths " if isinstance(recovery, Surface) and recovery.dim == 3 else ""
    header(figure, about + recovery.status, details(recovery), style.STATUS.get(recovery.status, style.TEXT))
    footer(figure, handles)
    if path is not None:
        write_figure(figure, path)
    return figure


def planar_mesh(mesh: PlanarMesh) -> tuple[Figure, Sequence[Artist]]:
    """A planar mesh, and handles for the legend."""
    points = laid_out(mesh)
    figure, (ax,) = panels([extent(points, mesh.component >= 0)])
    handles = draw_mesh(ax, mesh, points, outer_loops(mesh))
    handles += draw_hinges(ax, points[mesh.hinges])
    if not mesh.certified:
        handles += draw_worst(ax, points, mesh.worst_entries)
    return figure, handles


def details(recovery: Recovery) -> str:
    """Sizes, factor and certificate in one line."""
    parts = [count_of(recovery.n_points, "point"), *counted_cells(recovery)]
    if recovery.n_components > 1:
        parts.append(count_of(recovery.n_components, "piece"))
    missing = int(np.count_nonzero(recovery.node_status))
    if missing:
        parts.append(f"{missing:,} not determined")
    if isinstance(recovery, Surface) and recovery.realisation is not None and recovery.dim == 3:
        parts.append(f"edge lengths off by {recovery.realisation['misfit']:.1e}")
    if not isinstance(recovery, Mechanical):
        parts.append(f"c = {scale_text(recovery, 6)}")
    elif isinstance(recovery, Body) and recovery.poisson_ratio is not None:
        parts.append(f"Poisson's ratio {recovery.poisson_ratio:.6g}")
    parts.append(f"backward error {recovery.backward_error:.1e}")
    return "  ·  ".join(parts)
