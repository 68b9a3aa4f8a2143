"""From the sparsity graph to faces, orientation, boundary loops and pieces; no coordinates here."""

from .numbering import Numbering, components, local_numbering
from .polygons import Polygons
from .recognise import located, require_planar, surfaces
from .surface import Piece, Topology

__all__ = [
    "Numbering",
    "Piece",
    "Polygons",
    "Topology",
    "components",
    "local_numbering",
    "located",
    "require_planar",
    "surfaces",
]
