"""Semidefinite matrices made definite by a small multiple of the identity, normal equations, singular values."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from ..errors import GeometryError, SolverError
from .factorisation import Factorisation, factorisation
from .upper import UpperTriangle

_SHIFTS = (1e-14, 1e-12, 1e-10)
"""Of the typical diagonal: around the rounding of a normal matrix, and below every eigenvalue that is not zero."""

STEPS = 3
"""Of inverse iteration, each of which divides what is not wanted by its eigenvalue over the shift, 1e4 and more."""


@contextmanager
def nearly_singular(matrix: UpperTriangle, analysed: Factorisation | None = None) -> Iterator[Factorisation]:
    """Cholesky factor of a real semidefinite matrix plus the least multiple of the identity that rounding allows.

    With an analysis of the pattern that is there already, which stays with who made it.

    Raises GeometryError if a pivot vanishes even with the largest.
    """
    block = matrix.block
    start = matrix.indptr[:-1]
    own = matrix.data[start].reshape(-1, block, block)
    diagonal = np.diagonal(own, axis1=1, axis2=2)
    # Unknowns in no equation are stored with less.
    there = diagonal > np.finfo(float).eps ** 2 * diagonal.max(initial=0.0)
    typical = float(np.median(diagonal[there])) if there.any() else 1.0
    solver = analysed or factorisation(matrix, definite=True)
    try:
        for shift in _SHIFTS:
            data = matrix.data.copy()
            data[start] = (own + shift * typical * np.eye(block)).reshape(data[start].shape)
            try:
                solver.factorise(matrix.with_data(data))
                break
            except SolverError:  # rounding made a pivot vanish
                continue
        else:
            raise GeometryError(
                "the normal matrix of the equations is not positive; the entries may differ too much in size"
            )
        yield solver
    finally:
        if analysed is None:
            solver.release()


def solved(normal: sp.csr_array, rhs: NDArray) -> NDArray[np.float64]:
    """Solve normal equations (n, n) once; raises SolverError if they are not finite, or singular."""
    matrix = UpperTriangle.of(normal)
    factor = factorisation(matrix)
    factor.factorise(matrix)
    solution = factor.solve(rhs)
    factor.release()
    if not np.isfinite(solution).all():
        raise SolverError("normal equations are singular")
    return np.asarray(solution)


def svd(
    matrix: ArrayLike, *, full_matrices: bool = True
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """U, singular values and V^T, as :func:`scipy.linalg.svd` has them.

    By divide and conquer, which gives up now and then where many values are next to zero; then by QR iterations.
    """
    try:
        found = scipy.linalg.svd(matrix, full_matrices=full_matrices)
    except np.linalg.LinAlgError:
        found = scipy.linalg.svd(matrix, full_matrices=full_matrices, lapack_driver="gesvd")
    return found
