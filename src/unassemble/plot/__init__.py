"""Pictures of recovered meshes, drawn without a display."""

from ..files import check_plot as check_plot
from .canvas import laid_out as laid_out
from .mesh import outer_loops as outer_loops
from .picture import plot_recovery as plot_recovery
