"""Analysis of a pattern in a thread of its own, while other work goes on."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from .factorisation import Factorisation, factorisation
from .threads import threads
from .upper import UpperTriangle


class AnalysisAhead:
    """A fill-reducing ordering begun before it is known whether it will be needed.

    Called with a matrix it does what :func:`factorisation` does; where the matrix has the foreseen pattern, that has
    been done, or is about to be.

    Parameters
    ----------
    pattern : UpperTriangle
        Its entries do not matter, but their type does.
    thread_count : int, optional
        As for :func:`~unassemble.linalg.threads`: limits hold for the thread that sets them.
    """

    def __init__(self, pattern: UpperTriangle, thread_count: int | None = None):
        self._pattern = pattern
        self._thread_count = thread_count
        executor = ThreadPoolExecutor(1, "analysis")
        self._pending: Future[Factorisation] | None = executor.submit(self._analyse)
        executor.shutdown(wait=False)

    def _analyse(self) -> Factorisation:
        with threads(self._thread_count):
            return factorisation(self._pattern)

    def __call__(self, matrix: UpperTriangle) -> Factorisation:
        """Analyse the pattern of a Hermitian matrix."""
        same = (
            matrix.data.dtype == self._pattern.data.dtype
            and np.array_equal(matrix.indptr, self._pattern.indptr)
            and np.array_equal(matrix.indices, self._pattern.indices)
        )
        pending, self._pending = self._pending, None  # whoever has the factorisation decides how long it lives
        return pending.result() if pending and same else factorisation(matrix)
