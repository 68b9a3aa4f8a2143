"""Number of threads of the linear algebra libraries."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any

from threadpoolctl import threadpool_limits

from ..errors import InputError
from .factorisation import backend


def threads(count: int | None) -> AbstractContextManager[Any]:
    """Within this context BLAS and PARDISO use `count` threads; None leaves them as they are."""
    if count is None:
        return nullcontext()
    if count < 1:
        raise InputError(f"`threads` is at least 1, not {count}")
    backend()  # loads MKL, so that the limit reaches it
    return threadpool_limits(count)


def blas_threads(count: int) -> AbstractContextManager[Any]:
    """Within this context numpy's and scipy's own BLAS use `count` threads; PARDISO keeps its.

    Panels of a dozen columns gain little from threads, and lose much where other work keeps a core busy: threads wait
    for each other many times per factorisation.
    """
    return threadpool_limits({"libopenblas": count, "libscipy_openblas": count, "openblas": count})
