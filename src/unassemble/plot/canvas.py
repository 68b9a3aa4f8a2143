"""Figures without pyplot: size, where pieces are drawn, header, footer, and writing them."""

import os
from collections.abc import Sequence
from pathlib import PurePath

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..files import whole_file
from ..recovery import Recovery
from ..topology.numbering import connected
from . import style


def write_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure, whole or not at all; without the date, so that the same mesh gives the same file."""
    suffix = PurePath(path).suffix.lower()
    metadata = dict.fromkeys({".svg": ["Date"], ".pdf": ["CreationDate"]}.get(suffix, []))
    with whole_file(path, suffix) as draft, matplotlib.rc_context({"svg.hashsalt": "unassemble"}):
        figure.savefig(draft, format=suffix[1:], dpi=style.DPI, metadata=metadata)


def panel(extent: NDArray, ax: Axes | None) -> tuple[Figure, Axes]:
    """A box for what `extent` (2, 2) encloses: an axes of the caller's, or that of a figure of its own."""
    low, high = extent
    if ax is not None:
        return _showing(ax, low, high).figure, ax  # type: ignore[return-value]
    size = np.maximum(high - low, 1e-3 * max(float((high - low).max()), 1e-300))
    size *= (np.array(style.PAGE.largest) / size).min()
    width = max(float(size[0]), style.PAGE.narrowest)
    total = np.array([width + 2 * style.PAGE.margin, size[1] + style.PAGE.header + style.PAGE.footer])
    figure = Figure(figsize=(float(total[0]), float(total[1])), facecolor="white")
    corner = np.array([style.PAGE.margin + (width - size[0]) / 2, style.PAGE.footer])
    return figure, _showing(figure.add_axes((*(corner / total), *(size / total))), low, high)


def _showing(ax: Axes, low: NDArray, high: NDArray) -> Axes:
    """The axes with the limits of a box, and a margin, which keeps the boundary line from being cut."""
    pad = 0.012 * float((high - low).max())
    ax.set(xlim=(low[0] - pad, high[0] + pad), ylim=(low[1] - pad, high[1] + pad), aspect="equal")
    ax.set_axis_off()
    return ax


def header(figure: Figure, headline: str, details: str, colour: str) -> None:
    """A bold line and a plain one below, left-aligned at the top."""
    width, height = figure.get_size_inches()
    x = style.PAGE.margin / width
    figure.text(x, 1 - 0.16 / height, headline, color=colour, size=12, weight="bold", va="top")
    figure.text(x, 1 - 0.41 / height, details, color=style.TEXT, size=8.5, va="top")


def footer(figure: Figure, handles: Sequence[Artist]) -> None:
    """A legend in one row at the bottom."""
    if handles:
        width, _ = figure.get_size_inches()
        more = {"bbox_to_anchor": (style.PAGE.margin / width, 0), "ncols": len(handles), "labelcolor": style.TEXT}
        gaps = {"borderaxespad": 0.4, "borderpad": 0, "handlelength": 1.6, "columnspacing": 1.8}
        figure.legend(handles=handles, loc="lower left", frameon=False, fontsize=8.5, **more, **gaps)


def laid_out(mesh: Recovery) -> NDArray[np.float64]:
    """(n, 2) points of a mesh for the eye; what hangs together, by edges or in hinges, stays together."""
    triangles = mesh.divided()[0]
    label = connected(mesh.n_points, triangles[:, [0, 0]].ravel(), triangles[:, 1:].ravel())[1]
    used = np.unique(triangles)
    part = np.full(mesh.n_points, -1)
    part[used] = np.unique(label[used], return_inverse=True)[1]
    return apart(mesh.points, part)


def apart(points: NDArray[np.float64], part: NDArray[np.int64]) -> NDArray[np.float64]:
    """(n, 2) points, one part beside the other if the boxes around any two overlap, as by their own frames they may.

    Parts are numbered by `part`, (n,), which is negative for points of none.
    """
    count = int(part.max(initial=-1)) + 1
    used = (part >= 0) & np.isfinite(points).all(axis=1)
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, part[used], points[used])
    np.maximum.at(high, part[used], points[used])
    meet = np.all((low[:, None] < high) & (high[:, None] > low), axis=2)
    if not np.triu(meet, 1).any():
        return points
    size = np.maximum(high - low, 0)
    row, column = np.divmod(np.arange(count), int(np.ceil(np.sqrt(count))))
    corner = np.column_stack([column, -row]) * (1.06 * size.max(axis=0))
    return points + np.where(part[:, None] >= 0, (corner - np.where(size > 0, low, 0))[part], 0)
