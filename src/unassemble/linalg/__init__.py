"""Sparse linear algebra behind one small interface."""

from .ahead import AnalysisAhead
from .augmented import AugmentedSystem
from .definite import nearly_singular, solved
from .factorisation import Factorisation, backend, factorisation
from .threads import blas_threads, threads
from .upper import UpperTriangle, upper_from_edges

__all__ = [
    "AnalysisAhead",
    "AugmentedSystem",
    "Factorisation",
    "UpperTriangle",
    "backend",
    "blas_threads",
    "factorisation",
    "nearly_singular",
    "solved",
    "threads",
    "upper_from_edges",
]
