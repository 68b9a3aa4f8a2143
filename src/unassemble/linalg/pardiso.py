"""Intel MKL PARDISO, called through the library that ``pypardiso`` brings along.

``pypardiso`` itself drives real matrices only; the conformal system is complex Hermitian, so the
one C entry point is called here, with the phases separated: analysis once, factorisations many.
Parameter numbers are those of the oneMKL reference, "Intel oneMKL PARDISO - Parallel Direct Sparse
Solver Interface", counted from 1 there and from 0 in ``_iparm``.
"""

import ctypes
import os
import re
import sys
import threading
from enum import IntEnum
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution

import numpy as np
from numpy.typing import NDArray

from ..errors import SolverError
from .upper import UpperTriangle


class _MatrixType(IntEnum):
    REAL_DEFINITE = 2
    REAL_INDEFINITE = -2
    COMPLEX_HERMITIAN_INDEFINITE = -4


class _Phase(IntEnum):
    ANALYSE = 11
    FACTORISE = 22
    SOLVE = 33
    RELEASE = -1


@cache
def _library() -> ctypes.CDLL:
    # A handle of our own: ctypes keeps argument types per handle, and pypardiso's declares pointers to reals.
    path = _installed()
    if path is None:
        from pypardiso import PyPardisoSolver

        path = str(PyPardisoSolver().libmkl._name)  # it looks through the whole environment
    library = ctypes.CDLL(path)
    if "MKL_CBWR" not in os.environ:
        # The same bits on every run: sums of several threads are otherwise added in the order in which they come in.
        library.MKL_CBWR_Set(2)  # MKL_CBWR_AUTO: the fastest code for this processor that is reproducible
    return library


def _installed() -> str | None:
    """Path of the library that the package ``mkl`` has installed."""
    try:
        files = distribution("mkl").files or []
    except PackageNotFoundError:
        return None
    paths = (str(file.locate()) for file in files if re.fullmatch(r"(lib)?mkl_rt\b.*(so|dylib|dll)[.\d]*", file.name))
    return next(filter(os.path.exists, paths), None)


def available() -> bool:
    """Whether the MKL library can be loaded."""
    try:
        _library()
    except (ImportError, OSError):
        return False
    return True


_ONE_AT_A_TIME = threading.RLock()  # two calls at once, even on matrices of their own, spoil memory


class PardisoFactorisation:
    """Factorisation L D L* of a Hermitian matrix, real or complex.

    Real definite matrices by Cholesky, which fails where a pivot is not positive. The pattern is analysed (ordered)
    once and kept for every later ``factorise``.

    Raises SolverError if a pivot is zero, or PARDISO gives up for another reason; MemoryError.
    """

    def __init__(self, matrix: UpperTriangle, *, definite: bool = False):
        self._handle = np.zeros(64, dtype=np.int64)
        self._iparm = np.zeros(64, dtype=np.int32)
        self._iparm[0] = 1  # no defaults: all of iparm is set here
        # Below, MKL's parallel ordering gains nothing, and has been seen to spoil memory.
        large = matrix.n >= 1000
        self._iparm[1] = 3 if large else 2  # nested dissection, in parallel if that pays
        self._iparm[9] = 30  # never perturb a pivot: shifts next to an eigenvalue have small ones, rightly
        self._iparm[17] = -1  # count the entries of the factor
        self._iparm[20] = 1  # Bunch-Kaufman pivots; without them shifts next to an eigenvalue lose all digits
        self._iparm[23] = int(large)  # two-level parallel factorisation: its solves take half the time on two cores
        self._iparm[34] = 1  # indices count from 0
        if matrix.block > 1:
            self._iparm[36] = matrix.block  # rows of square blocks
        complex_entries = np.iscomplexobj(matrix.data)
        if complex_entries:
            self._mtype = _MatrixType.COMPLEX_HERMITIAN_INDEFINITE
        else:
            self._mtype = _MatrixType.REAL_DEFINITE if definite else _MatrixType.REAL_INDEFINITE
        self._dtype = np.dtype(np.complex128 if complex_entries else np.float64)
        self._matrix = matrix
        self._call(_Phase.ANALYSE)

    def factorise(self, matrix: UpperTriangle) -> None:
        """Factorise a matrix with the analysed pattern."""
        sizes = np.abs(matrix.data)
        size = float(sizes.max(initial=0.0))
        if not size <= 1e30:  # such entries have been seen to spoil memory
            raise SolverError(f"a matrix to be factorised has entries that are not finite, or as large as {size:.1e}")
        # Next to such entries and rows of zeros pivots overflow, and a segmentation fault follows.
        tiny = (sizes > 0) & (sizes < max(np.finfo(float).eps ** 2 * size, 1e-100))
        if tiny.any():
            matrix = matrix.with_data(np.where(tiny, 0, matrix.data))
            seen = np.zeros(matrix.n, dtype=bool)
            filled = (matrix.data != 0).reshape(len(matrix.data), -1).any(axis=1)
            seen[matrix.indices[filled]] = seen[np.repeat(np.arange(matrix.n), np.diff(matrix.indptr))[filled]] = True
            if not seen.all():
                raise SolverError(f"row {int(np.argmin(seen))} of a matrix to be factorised vanishes beside the others")
        old = self._matrix
        if not (np.array_equal(matrix.indptr, old.indptr) and np.array_equal(matrix.indices, old.indices)):
            raise ValueError("the pattern is not the one that was analysed")  # PARDISO would write beyond its memory
        self._matrix = matrix
        self._call(_Phase.FACTORISE)

    def solve(self, rhs: NDArray) -> NDArray:
        """Solve for one right-hand side (n,) or several (n, k)."""
        rhs = np.asfortranarray(rhs, dtype=self._dtype)
        solution = np.empty_like(rhs, order="F")
        self._call(_Phase.SOLVE, rhs, solution)
        return solution

    def release(self) -> None:
        """Give the memory of the factor back."""
        if self._handle.any():
            self._call(_Phase.RELEASE)
            self._handle[:] = 0

    def __del__(self) -> None:
        if not sys.is_finalizing():
            self.release()

    def _call(self, phase: int, rhs: NDArray | None = None, solution: NDArray | None = None) -> None:
        m = self._matrix
        unused = np.zeros(1)
        one = ctypes.byref(ctypes.c_int(1))
        n_rhs = 1 if rhs is None or rhs.ndim == 1 else rhs.shape[1]
        error = ctypes.c_int(0)
        data = np.ascontiguousarray(m.data, dtype=self._dtype)
        with _ONE_AT_A_TIME:
            _library().pardiso(
                _pointer(self._handle), one, one,
                ctypes.byref(ctypes.c_int(self._mtype)), ctypes.byref(ctypes.c_int(phase)),
                ctypes.byref(ctypes.c_int(m.n)), _pointer(data), _pointer(m.indptr), _pointer(m.indices),
                _pointer(unused), ctypes.byref(ctypes.c_int(n_rhs)), _pointer(self._iparm),
                ctypes.byref(ctypes.c_int(0)),
                _pointer(unused if rhs is None else rhs), _pointer(unused if solution is None else solution),
                ctypes.byref(error),
            )  # fmt: skip
        if error.value == -2:
            raise MemoryError(f"PARDISO found too little memory to factorise a matrix of order {m.n * m.block}")
        if error.value:
            reasons = {-3: "the reordering failed", -4: "a pivot is zero", -8: "a 32-bit index overflowed"}
            reason = reasons.get(error.value, f"error {error.value}")
            raise SolverError(f"PARDISO could not go on with a matrix of order {m.n * m.block}: {reason}")


def _pointer(array: NDArray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)
