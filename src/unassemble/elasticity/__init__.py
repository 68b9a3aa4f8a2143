"""Vector-valued matrices: node positions from the linear identities of isotropic elasticity."""

from .modes import rigid_body_modes, save_amgcl_coordinates, save_petsc_vec
from .recover import recover_elasticity, scalar_parts
from .results import ElasticityRecovery, Evidence, ScalarParts
from .rows.numbering import Numbering
from .unknowns import given_numbering

__all__ = [
    "ElasticityRecovery",
    "Evidence",
    "Numbering",
    "ScalarParts",
    "given_numbering",
    "recover_elasticity",
    "rigid_body_modes",
    "save_amgcl_coordinates",
    "save_petsc_vec",
    "scalar_parts",
]
