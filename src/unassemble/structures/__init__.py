"""Frames, shells and plates, whose nodes have rotations beside displacements; and trusses, which consist of bars."""

from .beams import find_beam
from .frames import serve_structure
from .layouts import Layout
from .placed import pieces
from .recognise import StructuralNumbering, find_structure, given_structure
from .trusses import truss_numbering

__all__ = [
    "Layout",
    "StructuralNumbering",
    "find_beam",
    "find_structure",
    "given_structure",
    "pieces",
    "serve_structure",
    "truss_numbering",
]
