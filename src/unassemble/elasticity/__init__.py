"""Vector-valued matrices: node positions from the linear identities of isotropic elasticity."""

from .modes import rigid_body_modes, save_amgcl_coordinates, save_petsc_vec
from .recover import ElasticityRecovery, Evidence, ScalarParts, recover_elasticity, scalar_parts

__all__ = [
    "ElasticityRecovery",
    "Evidence",
    "ScalarParts",
    "recover_elasticity",
    "rigid_body_modes",
    "save_amgcl_coordinates",
    "save_petsc_vec",
    "scalar_parts",
]
