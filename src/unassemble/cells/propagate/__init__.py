"""Cells and holes that follow from local equations, one after the other, where c is known."""

from .told import ContradictionError as ContradictionError, lone_scales as lone_scales, told as told
