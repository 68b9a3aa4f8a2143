"""Results: one frozen type for each kind of answer, what they share, and how each is finished.

Files, reports, pictures and near-null spaces are made of a result from above, in :mod:`unassemble.outputs`.
"""

from .base import ELEMENT_NAMES as ELEMENT_NAMES, SHOWN as SHOWN, Recovery as Recovery
from .finish import (
    Comparison as Comparison,
    Examined as Examined,
    Placed as Placed,
    finish as finish,
)
from .mechanical import Body as Body, Evidence as Evidence, Mechanical as Mechanical, Structure as Structure
from .scalar import ConformingMesh as ConformingMesh, PlanarMesh as PlanarMesh, Surface as Surface
