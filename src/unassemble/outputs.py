"""What is made of a result, as methods of it: the one module that knows both results and outputs."""

from __future__ import annotations

from html import escape
from os import PathLike
from typing import TYPE_CHECKING, Any

from .exchange import to_meshio
from .export import save
from .modes import modes_of
from .progress import quiet_libraries
from .recovery import Body, ConformingMesh, PlanarMesh, Recovery, Structure, Surface
from .report import build_report, write_report
from .summary import one_line, summary, table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Body", "ConformingMesh", "PlanarMesh", "Recovery", "Structure", "Surface"]


def plot(recovery: Recovery, path: str | PathLike[str] | None = None, *, ax: Axes | None = None) -> Figure:
    """Draw the mesh; see :func:`unassemble.plot.plot_recovery`."""
    from .plot import plot_recovery  # loads matplotlib

    with quiet_libraries():
        return plot_recovery(recovery, path, ax=ax)


def report(recovery: Recovery, path: str | PathLike[str] | None = None) -> dict[str, Any]:
    """All that there is to say; see :func:`unassemble.report.build_report`.

    Written as ``.json`` where a path is given; raises OutputError where that cannot be.
    """
    found = build_report(recovery)
    if path is not None:
        write_report(found, path)
    return found


def as_html(recovery: Recovery) -> str:
    """For notebooks: status, reason and sizes in a table, with a picture of the mesh if it has a shape."""
    import base64
    import io

    rows = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in table(recovery))
    if not recovery.drawable:
        return f"<table>{rows}</table>"
    stream = io.BytesIO()
    plot(recovery).savefig(stream, format="png", dpi=72)
    picture = base64.b64encode(stream.getvalue()).decode()
    return f'<table>{rows}</table><img alt="the mesh" src="data:image/png;base64,{picture}"/>'


Recovery.save = save
Recovery.to_meshio = to_meshio
Recovery.report = report
Recovery.plot = plot
Recovery.rigid_body_modes = modes_of
Recovery.__repr__ = one_line  # type: ignore[method-assign, assignment]
Recovery.__str__ = summary  # type: ignore[method-assign, assignment]
Recovery._repr_html_ = as_html
