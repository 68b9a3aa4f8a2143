"""Labels to conformal map to misfit: the only test of acceptance."""
