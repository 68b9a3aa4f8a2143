"""Sparse linear algebra behind one small interface."""

from .definite import nearly_singular as nearly_singular, solved as solved, svd as svd
from .factorisation import (
    Factorisation as Factorisation,
    backend as backend,
    blas_threads as blas_threads,
    factorisation as factorisation,
    threads as threads,
)
from .responses import SamplingOptions as SamplingOptions
from .upper import UpperTriangle as UpperTriangle, upper_from_edges as upper_from_edges
