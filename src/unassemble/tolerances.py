"""All tolerances of the library: one name, one reason and one value each.

Sections by subject. A number that follows from machine epsilon and sizes is computed where it is used, and a choice
of the caller is a field of a frozen options type: neither belongs here.
"""

# Entries.

LAST_DIGITS = 1e-14
"""What rounding of a few operations in double precision leaves, relative to what they work on; below it is nothing."""

ROUNDED = 1e-12
"""Relative difference up to which entries are the same number, or none: assemblers leave that much in any matrix."""

SUMMED = 1e-10
"""Relative error of sums of entries, and of entries that were summed in two orders, as both triangles are."""

CANCELLED = 1e-9
"""Relative size of what is left of terms that cancel, up to which it is rounding; supports leave 1e-3 and more."""

PENALTY = 1e3
"""How many times the rest of its row a diagonal entry is, at least, that is a penalty."""

SIGMAS = 10.0
"""Standard deviations that no difference of independent noise exceeds, in a matrix of any size."""

# What was solved for.

SINGULAR = 1e-9
"""Singular value, or eigenvalue, up to which it is zero: rounding leaves far less, and gaps are 1e-4 and more."""

AGREED = 1e-9
"""Relative difference of two numbers worked out independently that do not come so close by chance."""

ALIKE = 1e-6
"""Relative difference up to which what was solved for is the same, or zero: half of the digits."""

MAGNIFIED = 1e5
"""By which factor c, and maps with the right cells, may be further off than the entries, where cells are slender."""

# Sizes and shares.

SMALL = 1e-3
"""Next to none beside one, yet safe to divide by."""

LITTLE = 0.1
"""Part of another quantity that is much less than it."""

HARDLY_ANY = 0.05
"""Share of rows or nodes of which chance, or wrong guesses, explain hardly more."""

MOST = 0.6
"""Share of rows or nodes that is most of them: more than the half to which wrong guesses come."""

NEARLY_ALL = 0.9
"""Share of rows or nodes that right guesses explain, at least, away from supports; some more add up by chance."""

PLACED = 1e-8
"""How far off positions may be, relative to the size of what is placed, where it is certified; and angles about a
vertex, in radians, where a surface is flat."""

# The certificate.

CERTIFIED = 1e-9
"""Largest backward error of a certified mesh: the polish leaves rounding, and a wrong cell leaves far more."""

SUSPICIOUS = 1e-12
"""Backward error up to which nothing but rounding is left; above it one entry may be wrong."""

# Noise.

CHANCE = 1e-6
"""Probability at which agreement, or a term that explains a misfit, is no coincidence."""

CONFIDENCE = 1e-3
"""Least p-value of a mesh certified in the presence of noise: one right mesh in a thousand is refused."""

NOISY = 2.0
"""Root mean square of a misfit, over the errors expected, that these explain."""

LARGEST_NOISE = 0.05
"""Largest noise, relative to c, that is tested: an angle is then known to about as many radians."""
