"""From the sparsity graph to faces, orientation, boundary loops and pieces; no coordinates here."""

from .recognise import recognise
from .surface import Piece, Topology

__all__ = ["Piece", "Topology", "recognise"]
