"""Vector-valued matrices: node positions from the linear identities of isotropic elasticity."""

from .recover import recover_elasticity

__all__ = ["recover_elasticity"]
