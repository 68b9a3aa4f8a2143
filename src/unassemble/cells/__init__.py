"""Which faces of a planar graph are cells and which are holes, decided from the numbers.

Where entries vanish the graph alone does not tell: see the page on theory in the documentation.
"""

from .completion import completed, guessed
from .doubt import Attempt, Outcome, in_doubt
from .eliminated import incomplete_rows
from .unique.alternatives import Alternative, alternatives

__all__ = [
    "Alternative",
    "Attempt",
    "Outcome",
    "alternatives",
    "completed",
    "guessed",
    "in_doubt",
    "incomplete_rows",
]
