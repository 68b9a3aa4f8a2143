"""Figures without pyplot: size, header, footer, and writing them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import OutputError
from ..files import check_target, whole_file
from . import style

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Without the date, the same mesh gives the same file.
_METADATA: dict[str, dict[str, None]] = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}


def check_plot(path: str | os.PathLike[str]) -> None:
    """Find out, before long work, whether a picture can be written.

    Raises
    ------
    OutputError
        If the extension is not ``.png``, ``.svg`` or ``.pdf``, or the file cannot be written.
    """
    if PurePath(path).suffix.lower() not in _METADATA:
        raise OutputError(f"a picture is a {' or '.join(_METADATA)} file, not {os.fspath(path)!r}")
    check_target(path)


def write_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure, whole or not at all, in the format that the extension names."""
    import matplotlib

    check_plot(path)
    suffix = PurePath(path).suffix.lower()
    with whole_file(path, suffix) as draft, matplotlib.rc_context({"svg.hashsalt": "unassemble"}):
        figure.savefig(draft, format=suffix[1:], dpi=style.DPI, metadata=_METADATA[suffix])


def panels(extents: Sequence[NDArray]) -> tuple[Figure, list[Axes]]:
    """A figure with one box beside the other, all to one scale.

    Parameters
    ----------
    extents : sequence of (2, 2) float64
        Lower left and upper right corner of what each panel will show.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    sizes = np.array([high - low for low, high in extents])
    sizes = np.maximum(sizes, 1e-3 * max(float(sizes.max()), 1e-300))
    gap = style.PAGE.margin * 2 * (len(extents) - 1)
    room = np.array(style.PAGE.largest) * (1 + 0.4 * (len(extents) > 1), 1)
    scale = min((room[0] - gap) / sizes[:, 0].sum(), room[1] / sizes[:, 1].max())
    sizes = sizes * scale
    height = float(sizes[:, 1].max())
    content = float(sizes[:, 0].sum() + gap)
    width = max(content, style.PAGE.narrowest)
    total = np.array([width + 2 * style.PAGE.margin, height + style.PAGE.header + style.PAGE.footer])
    figure = Figure(figsize=(float(total[0]), float(total[1])), facecolor="white")
    FigureCanvasAgg(figure)
    axes = []
    left = style.PAGE.margin + (width - content) / 2
    for (low, high), size in zip(extents, sizes, strict=True):
        bottom = style.PAGE.footer + (height - size[1]) / 2
        ax = figure.add_axes((left / total[0], bottom / total[1], size[0] / total[0], size[1] / total[1]))
        axes.append(_showing(ax, low, high))
        left += size[0] + 2 * style.PAGE.margin
    return figure, axes


def panel(extent: NDArray, ax: Axes | None) -> tuple[Figure, Axes]:
    """A box for what `extent` (2, 2) encloses: an axes of the caller's, or that of a figure of its own."""
    if ax is None:
        figure, (ax,) = panels([extent])
        return figure, ax
    return _showing(ax, *extent).figure, ax  # type: ignore[return-value]


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
        legend = figure.legend(
            handles=list(handles),
            loc="lower left",
            bbox_to_anchor=(style.PAGE.margin / width, 0),
            ncols=len(handles),
            frameon=False,
            fontsize=8.5,
            borderaxespad=0.4,
            borderpad=0,
            handlelength=1.6,
            columnspacing=1.8,
        )
        for text in legend.get_texts():
            text.set_color(style.TEXT)
