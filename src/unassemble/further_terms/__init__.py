"""Scalar matrices with more than c L + D: a mass term, a mass matrix alone, rows and columns that were scaled."""

from .elements import less_mass, recover_elements_with_terms
from .recover import recover_with_terms

__all__ = ["less_mass", "recover_elements_with_terms", "recover_with_terms"]
