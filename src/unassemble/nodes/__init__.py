"""From rows to nodes: which rows are one node's, and what bodies and structures have in common from there on."""

from .anchoring import Request
from .grouping import by_first_row
from .nodal import nodal_matrix
from .numbering import Numbering
from .rounded import with_exact_sums
from .shape import SOFT, shape
from .unknowns import find_numbering, given_numbering

__all__ = [
    "SOFT",
    "Numbering",
    "Request",
    "by_first_row",
    "find_numbering",
    "given_numbering",
    "nodal_matrix",
    "shape",
    "with_exact_sums",
]
