"""Cells and holes that follow from local equations, one after the other, where c is known."""

from .told import ContradictionError, lone_scales, told

__all__ = ["ContradictionError", "lone_scales", "told"]
