"""Which faces of a planar graph are cells and which are holes, decided from the numbers.

Where entries vanish the graph alone does not tell: see the page on theory in the documentation.
"""

from .completion import Outcome, completed
from .search import read_cells

__all__ = ["Outcome", "completed", "read_cells"]
