"""All tolerances of the library: one name, one reason and one value each.

Sections by subject. A number that follows from machine epsilon and sizes is computed where it is used, and a choice
of the caller is a field of a frozen options type: neither belongs here.
"""

from __future__ import annotations

# Entries.

ROUNDED = 1e-12
"""Relative difference up to which entries are the same number, or none: assemblers leave that much in any matrix."""

SUMMED = 1e-10
"""Relative error of sums of entries, and of entries that were summed in two orders, as both triangles are."""

CANCELLED = 1e-9
"""Relative size of what is left of terms that cancel, up to which it is rounding; supports leave 1e-3 and more."""

SIGMAS = 10.0
"""Standard deviations that no difference of independent noise exceeds, in a matrix of any size."""

SAME_SCALE = 1e-6
"""Relative difference of factors c that count as one."""

SCALE_ERROR = 1e5
"""Relative error of c in small pieces, over that of the entries, at most."""

# The certificate.

CERTIFIED = 1e-9
"""Largest backward error of a certified mesh: the polish leaves rounding, and a wrong cell leaves far more."""

SUSPICIOUS = 1e-12
"""Backward error above which a mesh is certified only if no few entries carry the misfit."""

# Noise.

CHANCE = 1e-6
"""Probability at which agreement, or a few entries that explain a misfit, are no coincidence."""

CONFIDENCE = 1e-3
"""Least p-value of a mesh certified in the presence of noise: one right mesh in a thousand is refused."""

LARGEST_NOISE = 0.05
"""Largest noise, relative to c, that is tested: an angle is then known to about as many radians."""
