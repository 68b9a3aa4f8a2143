"""Sparse linear algebra behind one small interface."""

from .ahead import AnalysisAhead
from .augmented import AugmentedSystem
from .definite import nearly_singular, solved
from .factorisation import Factorisation, backend, factorisation
from .quiet import quiet
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
    "quiet",
    "solved",
    "threads",
    "upper_from_edges",
]
