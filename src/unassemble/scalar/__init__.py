"""Scalar matrices: everything that ``recover`` does with one, from its topology to the verdict."""

from .joined import JoinedMesh
from .recover import recover_scalar

__all__ = [
    "JoinedMesh",
    "recover_scalar",
]
