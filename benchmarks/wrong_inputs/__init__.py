"""Random matrices for ``benchmarks/wrong.py``, each with the truth about its mesh, one module for each family."""

from .bodies import BODIES as BODIES
from .scalar import SCALAR as SCALAR
from .structures import STRUCTURES as STRUCTURES
from .truth import Truth as Truth

#: Every kind by its name: a function of a random generator alone.
KINDS = {**STRUCTURES, **BODIES, **SCALAR}
