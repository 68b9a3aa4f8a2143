"""Cells and holes that follow from local equations, one after the other, where c is known."""

from .patches import arcs_across, patches
from .peeling import ContradictionError, lone_scales, peeled

__all__ = [
    "ContradictionError",
    "arcs_across",
    "lone_scales",
    "patches",
    "peeled",
]
