"""Scalar matrices: everything that ``recover`` does with one, from its topology to the verdict."""

from .joined import joined
from .recover import recover_scalar

__all__ = [
    "joined",
    "recover_scalar",
]
