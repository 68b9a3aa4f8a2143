"""Labels to conformal map to misfit: the only test of acceptance."""

from .labelling import FITS, Labelling

__all__ = ["FITS", "Labelling"]
