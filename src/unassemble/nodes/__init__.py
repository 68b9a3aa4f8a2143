"""From rows to nodes: which rows are one node's, and what bodies and structures have in common from there on."""

from .numbering import Numbering
from .unknowns import find_numbering, given_numbering

__all__ = ["Numbering", "find_numbering", "given_numbering"]
