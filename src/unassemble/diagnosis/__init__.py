"""What a scalar matrix is, read off its graph and its sums without solving anything: one answer for everybody."""

from .kinds import PLANAR as PLANAR, Diagnosis as Diagnosis
from .mass import mass_matrix as mass_matrix, refuse_masses as refuse_masses
from .scalar import diagnosed as diagnosed, explained as explained, judged as judged
from .structural import indefinite as indefinite
from .sums import further_terms as further_terms
