"""The material of elements: which candidates for cells, with which Lame coefficients, add up to the matrix."""

from .cells import recognise_cells as recognise_cells
