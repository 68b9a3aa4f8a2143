"""Choice of the sparse direct solver and of its threads, and the solvers that ship with scipy."""

import os
from contextlib import AbstractContextManager, nullcontext
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, get_lapack_funcs
from scipy.sparse.linalg import splu
from threadpoolctl import threadpool_limits

from ..errors import InputError, SolverError
from . import pardiso
from .upper import UpperTriangle

_VARIABLE = "UNASSEMBLE_SOLVER"


class Factorisation(Protocol):
    """A Hermitian matrix pattern, analysed once and factorised as often as its entries change."""

    def factorise(self, matrix: UpperTriangle) -> None:
        """Factorise a matrix with the analysed pattern."""

    def solve(self, rhs: NDArray) -> NDArray:
        """Solve for one right-hand side (n,) or several (n, k)."""

    def release(self) -> None:
        """Give the memory of the factor back."""


def backend() -> str:
    """Name of the solver in use: ``"pardiso"`` where it loads, else ``"superlu"``.

    The environment variable ``UNASSEMBLE_SOLVER`` overrides the choice.
    """
    wanted = os.environ.get(_VARIABLE, "")
    if wanted not in ("", "pardiso", "superlu"):
        raise InputError(f"{_VARIABLE} is {wanted!r}; it can be 'pardiso' or 'superlu'")
    if wanted == "superlu":
        return "superlu"
    if pardiso.available():
        return "pardiso"
    if wanted == "pardiso":
        raise InputError(f"{_VARIABLE} is 'pardiso', but MKL does not load; try: pip install 'unassemble[fast]'")
    return "superlu"


def factorisation(matrix: UpperTriangle, *, definite: bool = False) -> Factorisation:
    """Analyse the pattern of a Hermitian matrix for factorisation; see :class:`Factorisation`."""
    if matrix.n * matrix.block <= 200:  # faster than PARDISO, and entries out of proportion do it no harm
        return _Dense(matrix, definite=definite)
    if backend() == "pardiso":
        return pardiso.PardisoFactorisation(matrix, definite=definite)
    return _SuperLU(matrix, definite=definite)


class _Dense:
    """LAPACK: Gaussian elimination with partial pivoting, or Cholesky for matrices that are to be definite."""

    def __init__(self, matrix: UpperTriangle, *, definite: bool):
        self._dtype, self._definite = np.complex128 if np.iscomplexobj(matrix.data) else np.float64, definite
        self._getrf, self._getrs = get_lapack_funcs(("getrf", "getrs"), dtype=self._dtype)

    def factorise(self, matrix: UpperTriangle) -> None:
        _require_finite(matrix)
        b, n = matrix.block, matrix.n
        blocks = np.zeros((n, b, n, b), dtype=self._dtype)
        blocks[np.repeat(np.arange(n), np.diff(matrix.indptr)), :, matrix.indices] = matrix.data.reshape(-1, b, b)
        upper = blocks.reshape(n * b, n * b)
        if self._definite:
            try:
                self._factor = cho_factor(upper, lower=False, check_finite=False)
            except LinAlgError as error:
                raise SolverError(f"a matrix of order {n * b} is not positive definite: {error}") from error
            return
        lu, pivots, info = self._getrf(np.triu(upper, 1) + np.triu(upper).conj().T)
        if info:
            raise SolverError(f"LAPACK could not go on with a matrix of order {n * b}: a pivot is zero")
        self._factor = lu, pivots

    def solve(self, rhs: NDArray) -> NDArray:
        rhs = np.asarray(rhs, dtype=self._dtype)
        if self._definite:
            return np.asarray(cho_solve(self._factor, rhs, check_finite=False))
        return np.asarray(self._getrs(*self._factor, rhs)[0])

    def release(self) -> None:
        self.__dict__.pop("_factor", None)


class _SuperLU:
    """SuperLU, which orders and factorises in one go: nothing is kept between factorisations."""

    def __init__(self, matrix: UpperTriangle, *, definite: bool):
        self._dtype, self._definite = np.complex128 if np.iscomplexobj(matrix.data) else np.float64, definite

    def factorise(self, matrix: UpperTriangle) -> None:
        _require_finite(matrix)
        # Minimum degree on A + A' with diagonal pivots preferred: SuperLU users' guide, "symmetric mode".
        options = {"SymmetricMode": True}
        try:
            threshold = 0.0 if self._definite else 0.001  # pivots of definite matrices stay on the diagonal
            self._lu = splu(matrix.full(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=threshold, options=options)
        except RuntimeError as error:
            raise SolverError(f"SuperLU could not go on with a matrix of order {matrix.n}: {error}") from error
        if self._definite and not (self._lu.U.diagonal().real > 0).all():
            self.release()
            raise SolverError(f"a matrix of order {matrix.n} is not positive definite: a pivot is not positive")

    def solve(self, rhs: NDArray) -> NDArray:
        return self._lu.solve(np.asfortranarray(rhs, dtype=self._dtype))

    def release(self) -> None:
        self.__dict__.pop("_lu", None)


def _require_finite(matrix: UpperTriangle) -> None:
    if not np.isfinite(matrix.data).all():
        raise SolverError("a matrix to be factorised has entries that are not finite")


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
