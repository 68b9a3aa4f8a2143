"""From the sparsity graph to faces, orientation, boundary loops and pieces; no coordinates here."""

from .numbering import Numbering, local_numbering
from .recognise import recognise
from .surface import Piece, Topology

__all__ = ["Numbering", "Piece", "Topology", "local_numbering", "recognise"]
