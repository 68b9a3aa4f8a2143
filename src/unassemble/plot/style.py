"""Colours and sizes of the pictures."""

from types import SimpleNamespace

FILL = "#edf3fa"
EDGE = "#4f7cac"
OUTER = "#12304f"
HOLE = "#e4572e"
HINGE = "#f2b134"
WORST = "#b5179e"
TEXT = "#3c4856"
STATUS = {"certified": "#2a7f4f", "ambiguous": "#b3441e", "uncertified": "#b3441e"}

MOST_VECTOR = 20_000  # shapes in a vector format; more become an image in it
DPI = 160
PAGE = SimpleNamespace(largest=(9.0, 7.2), narrowest=6.2, margin=0.25, header=0.76, footer=0.42)
"""Lengths in inches: the box that a mesh is fitted into, what a line of text needs, and the rims."""
