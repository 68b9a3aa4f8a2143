"""What a scalar matrix is, read off its graph and its sums without solving anything: one answer for everybody."""

from .answers import explained, judged
from .kinds import PLANAR, UNKNOWN, Diagnosis
from .scalar import LINEAR, diagnosed

__all__ = ["LINEAR", "PLANAR", "UNKNOWN", "Diagnosis", "diagnosed", "explained", "judged"]
