"""Labels to conformal map to misfit: the only test of acceptance."""

from .labelling import Labelling

__all__ = ["Labelling"]
