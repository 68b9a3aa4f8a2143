"""What can be a cell in a drawing of the graph."""
