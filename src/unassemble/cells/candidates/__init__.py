"""What can be a cell in an embedding of the graph, and what the angles suggest."""
