"""Results: one frozen type for each kind of answer, and what they share.

Files, reports, pictures and near-null spaces are made of a result from above, in :mod:`unassemble.outputs`.
"""

from .base import ELEMENT_NAMES, Recovery
from .mechanical import Body, Evidence, Mechanical, Structure
from .scalar import ConformingMesh, PlanarMesh, Surface

__all__ = [
    "ELEMENT_NAMES",
    "Body",
    "ConformingMesh",
    "Evidence",
    "Mechanical",
    "PlanarMesh",
    "Recovery",
    "Structure",
    "Surface",
]
