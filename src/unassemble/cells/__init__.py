"""Which faces of a planar graph are cells and which are holes, decided from the numbers.

Where entries vanish the graph alone does not tell: see the page on theory in the documentation.
"""

from .completion import completed, guessed
from .doubt import Outcome, in_doubt
from .undivided import undivided
from .unique.alternatives import SEARCHED_ROWS, Alternative, alternatives

__all__ = [
    "SEARCHED_ROWS",
    "Alternative",
    "Outcome",
    "alternatives",
    "completed",
    "guessed",
    "in_doubt",
    "undivided",
]
