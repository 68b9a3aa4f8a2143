"""Matrices that have lost rows: boundaries whose unknowns were eliminated.

Entries next to them contain cells that are gone, so that each says less than those of a whole mesh.
"""

from .elements import recover_partial_elements
from .lattices import recover_lattice
from .missing import with_boundary_edges, with_diagonals
from .partial import recover_partial
from .terms import recover_without_boundary_terms

__all__ = [
    "recover_lattice",
    "recover_partial",
    "recover_partial_elements",
    "recover_without_boundary_terms",
    "with_boundary_edges",
    "with_diagonals",
]
