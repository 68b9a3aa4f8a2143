"""Vector-valued matrices: node positions from the linear identities of isotropic elasticity."""

from .recover import recover_elasticity
from .results import ElasticityRecovery

__all__ = ["ElasticityRecovery", "recover_elasticity"]
