"""Frames, shells and plates, whose nodes have rotations beside displacements; and trusses, which consist of bars."""

from .beams import Beam, find_beam, serve_beam
from .frames import serve_structure
from .layouts import LAYOUTS, Layout, layout_named
from .placed import pieces
from .recognise import StructuralNumbering, find_structure, given_structure
from .trusses import truss_numbering

__all__ = [
    "LAYOUTS",
    "Beam",
    "Layout",
    "StructuralNumbering",
    "find_beam",
    "find_structure",
    "given_structure",
    "layout_named",
    "pieces",
    "serve_beam",
    "serve_structure",
    "truss_numbering",
]
