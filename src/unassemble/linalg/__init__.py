"""Sparse linear algebra behind one small interface."""

from .definite import nearly_singular, solved
from .factorisation import Factorisation, backend, factorisation
from .least_norm import least_norm
from .responses import SamplingOptions
from .singular import svd
from .threads import blas_threads, threads
from .upper import UpperTriangle, upper_from_edges

__all__ = [
    "Factorisation",
    "SamplingOptions",
    "UpperTriangle",
    "backend",
    "blas_threads",
    "factorisation",
    "least_norm",
    "nearly_singular",
    "solved",
    "svd",
    "threads",
    "upper_from_edges",
]
