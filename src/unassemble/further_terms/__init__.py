"""Scalar matrices with more than c L + D: a mass term, a mass matrix alone, rows and columns that were scaled."""

from .recover import recover_with_terms

__all__ = ["recover_with_terms"]
