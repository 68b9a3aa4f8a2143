"""Frames, shells and plates, whose nodes have rotations beside displacements; and trusses, which consist of bars."""

from .frames import serve_structure as serve_structure
from .placed import pieces as pieces
from .recognise import (
    StructuralNumbering as StructuralNumbering,
    find_structure as find_structure,
    given_structure as given_structure,
)
from .trusses import truss_numbering as truss_numbering
