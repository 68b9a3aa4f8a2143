"""Which faces of a planar graph are cells and which are holes, decided from the numbers.

Where entries vanish the graph alone does not tell: see the page on theory in the documentation.
"""

from .ambiguity import Exchange, exchanges
from .completion import Attempt, Outcome, completed, in_doubt
from .search import read_cells

__all__ = ["Attempt", "Exchange", "Outcome", "completed", "exchanges", "in_doubt", "read_cells"]
