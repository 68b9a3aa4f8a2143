"""Elements and their material: which there are, and whether they add up to the matrix."""
