"""Scalar matrices: everything that ``recover`` does with one, from its topology to the verdict."""

from .recover import recover_scalar

__all__ = ["recover_scalar"]
