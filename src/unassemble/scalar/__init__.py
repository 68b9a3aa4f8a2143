"""Scalar matrices: everything that ``recover`` does with one, from its topology to the verdict."""

from .recover import ScalarOptions, recover_scalar

__all__ = ["ScalarOptions", "recover_scalar"]
