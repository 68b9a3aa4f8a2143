"""How far numbers may differ that count as one."""

SAME_SCALE = 1e-6
"""Relative difference of factors c that count as one."""

SCALE_ERROR = 1e5
"""Relative error of c in small pieces, over that of the entries, at most."""
