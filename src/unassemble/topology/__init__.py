"""From the sparsity graph to faces, orientation, boundary loops and pieces; no coordinates here."""

from .cycles import chordless_four_cycles, not_faces, separating, three_cycles
from .keys import with_sides
from .numbering import Numbering, components, local_numbering
from .orientation import loops
from .pieces import planar_pieces
from .polygons import Polygons
from .recognise import located, require_planar, surfaces
from .surface import Piece, Topology

__all__ = [
    "Numbering",
    "Piece",
    "Polygons",
    "Topology",
    "chordless_four_cycles",
    "components",
    "local_numbering",
    "located",
    "loops",
    "not_faces",
    "planar_pieces",
    "require_planar",
    "separating",
    "surfaces",
    "three_cycles",
    "with_sides",
]
