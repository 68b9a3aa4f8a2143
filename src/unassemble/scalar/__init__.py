"""Scalar matrices: everything that ``recover`` does with one, from its topology to the verdict."""

from .joined import joined as joined
from .recover import recover_scalar as recover_scalar
