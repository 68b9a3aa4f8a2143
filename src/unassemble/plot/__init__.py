"""Pictures of recovered meshes, drawn without a display."""

from .canvas import check_plot
from .comparison import plot_comparison
from .picture import plot_recovery

__all__ = ["check_plot", "plot_comparison", "plot_recovery"]
