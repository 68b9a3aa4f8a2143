"""What a matrix is, and what can be recovered from it, without recovering it."""

from .inspect import Inspection, inspect_matrix

__all__ = ["Inspection", "inspect_matrix"]
