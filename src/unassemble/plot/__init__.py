"""Pictures of recovered meshes, drawn without a display."""

from ..files import check_plot
from .canvas import laid_out
from .mesh import outer_loops
from .picture import align, largest_error, plot_comparison, plot_recovery

__all__ = [
    "align",
    "check_plot",
    "laid_out",
    "largest_error",
    "outer_loops",
    "plot_comparison",
    "plot_recovery",
]
