"""Scalar matrices: everything that ``recover`` does with one, from its topology to the verdict."""

from .recover import of_other_scale, recover_scalar

__all__ = ["of_other_scale", "recover_scalar"]
