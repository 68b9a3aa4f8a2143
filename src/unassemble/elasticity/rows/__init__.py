"""Rows and what they couple to: what every search for nodes and directions starts from."""
