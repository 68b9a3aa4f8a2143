"""True and recovered mesh side by side."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..recovery import PlanarMesh, Recovery
from ..summary import counted_cells
from ..words import count_of
from . import style
from .canvas import check_plot, footer, header, panels, write_figure
from .mesh import draw_mesh, extent, outer_loops

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_comparison(true_points: ArrayLike, recovery: Recovery, path: str | os.PathLike[str] | None = None) -> Figure:
    """Draw the true mesh beside the recovered one, each piece moved by the best similarity or reflection.

    Parameters
    ----------
    true_points : (n, 2) array_like
        Row i belongs to matrix row i.
    recovery : PlanarMesh
    path : path, optional
        Write the picture there, whole or not at all: ``.png``, ``.svg`` or ``.pdf``.

    Raises
    ------
    InputError
        If `true_points` has another shape, or `recovery` is no planar mesh.
    OutputError
        If the file cannot be written.
    """
    if path is not None:
        check_plot(path)
    truth = np.asarray(true_points, dtype=np.float64)
    if not isinstance(recovery, PlanarMesh):
        raise InputError("only planar meshes are drawn beside the true ones")
    if truth.shape != recovery.points.shape:
        raise InputError(f"the true points have the shape {truth.shape}, the recovered {recovery.points.shape}")
    aligned = align(recovery.points, truth, recovery.component)
    figure, axes = panels([extent(truth, recovery.component >= 0)] * 2)
    outer = outer_loops(recovery)  # in the frame in which cells are counter-clockwise
    handles = []
    for ax, points, name in zip(axes, (truth, aligned), ("true", "recovered"), strict=True):
        handles = draw_mesh(ax, recovery, points, outer)
        ax.set_title(name, color=style.TEXT, size=9.5, style="italic", pad=3)
    header(figure, *_words(recovery, largest_error(aligned, truth)), style.STATUS.get(recovery.status, style.TEXT))
    footer(figure, handles)
    if path is not None:
        write_figure(figure, path)
    return figure


def align(points: NDArray, truth: NDArray, component: NDArray) -> NDArray[np.float64]:
    """Move each piece onto the true points by least squares over similarities, mirror images included."""
    aligned = np.array(points)
    for label in range(int(component.max(initial=-1)) + 1):
        rows = component == label
        if rows.any():
            aligned[rows] = _fit(points[rows], truth[rows])
    return aligned


def largest_error(aligned: NDArray, truth: NDArray) -> float:
    """Largest distance between points, relative to the diagonal of the box around the true ones."""
    rows = np.isfinite(aligned).all(axis=1)
    distance = np.linalg.norm(aligned[rows] - truth[rows], axis=1)
    return float(distance.max() / np.linalg.norm(np.ptp(truth[rows], axis=0)))


def _fit(points: NDArray, truth: NDArray) -> NDArray:
    source, target = points @ [1, 1j], truth @ [1, 1j]
    centre = target.mean()
    source, target = source - source.mean(), target - centre
    size = float(np.vdot(source, source).real) or 1.0
    images = [np.vdot(s, target) / size * s for s in (source, source.conj())]
    best = min(images, key=lambda image: float(np.linalg.norm(image - target))) + centre
    return np.column_stack([best.real, best.imag])


def _words(recovery: Recovery, error: float) -> tuple[str, str]:
    sizes = "  ·  ".join([count_of(recovery.n_points, "point"), *counted_cells(recovery)])
    return (
        f"{recovery.status}, largest error {error:.1e} of the diameter",
        f"{sizes}  ·  backward error {recovery.backward_error:.1e}",
    )
