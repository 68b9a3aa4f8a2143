"""Scalar matrices of other conforming elements in the plane: P2, P3, Q1, Q2, serendipity, triangles beside quads.

The form M = L/2 - T annihilates the coordinates whatever the element is (theory: any conforming element); cells come
from the sets of rows that are coupled to each other.
"""

from .assembly import AssembledEntries as AssembledEntries
from .parts import parts_of as parts_of
from .roles import OrderedCells as OrderedCells
