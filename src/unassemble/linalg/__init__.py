"""Sparse linear algebra behind one small interface."""

from .definite import nearly_singular, solved, svd
from .factorisation import Factorisation, backend, blas_threads, factorisation, threads
from .responses import SamplingOptions
from .upper import UpperTriangle, upper_from_edges

__all__ = [
    "Factorisation",
    "SamplingOptions",
    "UpperTriangle",
    "backend",
    "blas_threads",
    "factorisation",
    "nearly_singular",
    "solved",
    "svd",
    "threads",
    "upper_from_edges",
]
