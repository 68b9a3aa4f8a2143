"""Pieces that the identities leave bent, made straight by what their elements say."""

from .straight import Straight, in_place

__all__ = [
    "Straight",
    "in_place",
]
