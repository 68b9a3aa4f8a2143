"""Pictures of recovered meshes, drawn without a display."""

from .canvas import check_plot
from .comparison import align, largest_error, plot_comparison
from .layout import laid_out
from .mesh import outer_loops
from .picture import plot_recovery

__all__ = [
    "align",
    "check_plot",
    "laid_out",
    "largest_error",
    "outer_loops",
    "plot_comparison",
    "plot_recovery",
]
