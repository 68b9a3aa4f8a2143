"""Which faces of a planar graph are cells and which are holes, decided from the numbers.

Where entries vanish the graph alone does not tell: see the page on theory in the documentation.
"""

from .completion import completed as completed, guessed as guessed
from .doubt import Outcome as Outcome, in_doubt as in_doubt
from .undivided import undivided as undivided
from .unique.alternatives import (
    SEARCHED_ROWS as SEARCHED_ROWS,
    Alternative as Alternative,
    alternatives as alternatives,
)
