"""Pictures of recovered meshes, drawn without a display."""

from ..files import check_plot
from .canvas import laid_out
from .mesh import outer_loops
from .picture import plot_recovery

__all__ = [
    "check_plot",
    "laid_out",
    "outer_loops",
    "plot_recovery",
]
