"""Coefficients that are constant on regions: A = sum_r c_r L_r, each region with a factor of its own.

With the region of each triangle there are few more unknowns than without, and the same least squares give positions
and factors. Which triangles belong to which region, entries show nearly by themselves; exchanges next to what does not
fit decide the last ones.
"""

from .guess import uneven as uneven
from .recover import exchange_budget as exchange_budget, recover_regions as recover_regions
