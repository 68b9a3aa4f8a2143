"""Graphs of triangles and holes only, where nothing need have vanished."""
