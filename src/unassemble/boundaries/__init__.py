"""Matrices that have lost rows: boundaries whose unknowns were eliminated.

Entries next to them contain cells that are gone, so that each says less than those of a whole mesh.
"""

from .recover import recover_lattice

__all__ = ["recover_lattice"]
