"""Vector-valued matrices: node positions from the linear identities of isotropic elasticity."""
