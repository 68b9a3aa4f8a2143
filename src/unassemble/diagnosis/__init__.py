"""What a scalar matrix is, read off its graph and its sums without solving anything: one answer for everybody."""

from .kinds import PLANAR, Diagnosis
from .mass import mass_matrix, refuse_masses
from .scalar import diagnosed, explained, judged
from .structural import indefinite
from .sums import further_terms

__all__ = [
    "PLANAR",
    "Diagnosis",
    "diagnosed",
    "explained",
    "further_terms",
    "indefinite",
    "judged",
    "mass_matrix",
    "refuse_masses",
]
