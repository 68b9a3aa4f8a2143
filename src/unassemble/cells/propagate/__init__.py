"""Cells and holes that follow from local equations, one after the other, where c is known."""
