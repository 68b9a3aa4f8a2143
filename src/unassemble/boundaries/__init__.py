"""Matrices that have lost rows: boundaries whose unknowns were eliminated.

Entries next to them contain cells that are gone, so that each says less than those of a whole mesh.
"""

from .elements import recover_partial_elements as recover_partial_elements
from .lattices import recover_lattice as recover_lattice
from .missing import with_boundary_edges as with_boundary_edges, with_diagonals as with_diagonals
from .partial import recover_partial as recover_partial
from .terms import (
    recover_without_boundary_terms as recover_without_boundary_terms,
    unless_flow as unless_flow,
)
