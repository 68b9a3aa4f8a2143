"""What is made of a result, as methods of it: the one module that knows both results and outputs."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

from .export import save, to_meshio
from .metric.result import Surface
from .modes import modes_of
from .recovery import Body, PlanarMesh, Recovery, Structure
from .report import build_report

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Body", "PlanarMesh", "Recovery", "Structure", "Surface"]


def plot(recovery: Recovery, path: str | PathLike[str] | None = None) -> Figure:
    """Draw the mesh; see :func:`unassemble.plot.plot_recovery`."""
    from .plot import plot_recovery  # loads matplotlib

    return plot_recovery(recovery, path)


Recovery.save = save
Recovery.to_meshio = to_meshio
Recovery.report = build_report
Recovery.plot = plot
Recovery.rigid_body_modes = modes_of
