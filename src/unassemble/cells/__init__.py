"""Which faces of a planar graph are cells and which are holes, decided from the numbers.

Where entries vanish the graph alone does not tell: see the page on theory in the documentation.
"""

from .alternatives.ambiguity import AGREE, Untried, alternatives, touching
from .alternatives.corners import Alternative, OrientedMesh
from .alternatives.filled import filled_holes
from .alternatives.rereading import hidden
from .completion import completed, guessed
from .eliminated import incomplete_rows
from .misfits.coincidence import coincident
from .misfits.doubt import Attempt, Outcome, in_doubt
from .misfits.spoilt import settled, wrong_entries
from .search import read_cells

__all__ = [
    "AGREE",
    "Alternative",
    "Attempt",
    "OrientedMesh",
    "Outcome",
    "Untried",
    "alternatives",
    "coincident",
    "completed",
    "filled_holes",
    "guessed",
    "hidden",
    "in_doubt",
    "incomplete_rows",
    "read_cells",
    "settled",
    "touching",
    "wrong_entries",
]
