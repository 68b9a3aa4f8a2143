"""Results: one frozen type for each kind of answer, and what they share.

Files, reports, pictures and near-null spaces are made of a result from above, in :mod:`unassemble.outputs`.
"""

from .base import ELEMENT_NAMES, Recovery
from .kinds import Body, ConformingMesh, Evidence, Mechanical, PlanarMesh, Structure, Surface

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
