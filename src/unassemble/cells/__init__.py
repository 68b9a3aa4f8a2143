"""Which faces of a planar graph are cells and which are holes, decided from the numbers.

Where entries vanish the graph alone does not tell: see the page on theory in the documentation.
"""

from .ambiguity import AGREE, alternatives, touching
from .coincidence import coincident
from .completion import completed, guessed
from .corners import Alternative, OrientedMesh
from .doubt import Attempt, Outcome, in_doubt
from .eliminated import incomplete_rows
from .filled import filled_holes
from .search import read_cells
from .spoilt import settled, wrong_entries

__all__ = [
    "AGREE",
    "Alternative",
    "Attempt",
    "OrientedMesh",
    "Outcome",
    "alternatives",
    "coincident",
    "completed",
    "filled_holes",
    "guessed",
    "in_doubt",
    "incomplete_rows",
    "read_cells",
    "settled",
    "touching",
    "wrong_entries",
]
