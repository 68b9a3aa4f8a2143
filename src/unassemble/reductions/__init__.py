"""Matrices that become a Laplacian's: the anisotropic operator with constant tensor."""

from .anisotropic import ConstantTensor

__all__ = ["ConstantTensor"]
