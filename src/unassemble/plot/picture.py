"""A recovered mesh as a picture."""

import os

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..clock import Clock
from ..errors import FormatError
from ..files import check_plot
from ..metric import realised
from ..recovery import Recovery, Surface
from ..summary import counted_cells
from ..words import count_of
from . import style
from .body import plot_body
from .canvas import footer, header, laid_out, panel, write_figure
from .mesh import draw_hinges, draw_mesh, draw_worst, extent, outer_loops


def plot_recovery(recovery: Recovery, path: str | os.PathLike[str] | None = None, *, ax: Axes | None = None) -> Figure:
    """Draw a recovered mesh: cells, outer boundary, holes, hinges, and what fits worst if uncertified.

    Pieces whose frames overlap are drawn side by side. Points without coordinates are left out. Of bodies in space
    the outer surface is drawn, shaded. Surfaces that have edge lengths only are drawn in coordinates that come near
    these; the header says how near.

    Where a `path` is given, the picture is written there, whole or not at all: ``.png``, ``.svg`` or ``.pdf``.
    On an `ax` it is drawn without heading and legend, and the figure that this belongs to is returned.

    Raises OutputError if the file cannot be written; FormatError if there are no positions: of a mass matrix.
    """
    if path is not None:
        check_plot(path)
    if isinstance(recovery, Surface) and recovery.realisation is None:
        recovery = realised(recovery, Clock(), starts=1)  # edge lengths cannot be drawn
    if recovery.shapeless:
        raise FormatError(f"{recovery.shapeless}, and there is no shape to draw")
    if recovery.look.outlined:
        points = laid_out(recovery)
        figure, drawn = panel(extent(points, recovery.component >= 0), ax)
        handles: list[Artist] = [*draw_mesh(drawn, recovery, points, outer_loops(recovery))]
        handles += draw_hinges(drawn, points[recovery.hinges])
        handles += [] if recovery.certified else draw_worst(drawn, points, recovery.worst_entries)
    else:
        figure, handles = plot_body(recovery, ax)
    if ax is None:
        header(figure, recovery.title, _details(recovery), style.STATUS.get(recovery.status, style.TEXT))
        footer(figure, handles)
    if path is not None:
        write_figure(figure, path)
    return figure


def _details(recovery: Recovery) -> str:
    """Sizes, factor and certificate in one line."""
    parts = [count_of(recovery.n_points, "point"), *counted_cells(recovery)]
    if recovery.n_components > 1:
        parts.append(count_of(recovery.n_components, "piece"))
    missing = int(np.count_nonzero(recovery.node_status))
    if missing:
        parts.append(f"{missing:,} not determined")
    parts += recovery.details()
    parts.append(f"backward error {recovery.backward_error:.1e}")
    return "  ·  ".join(parts)
