"""S c L S with an unknown positive diagonal matrix S, as Jacobi scaling and equilibration leave it.

L annihilates constants, so that S c L S annihilates 1 / S: where nothing else stands on the diagonal a positive null
vector gives S, up to a factor that only c could tell it from. With an unknown D there is no such vector, and fewer
entries off the diagonal than coordinates and factors.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..certify import Terms
from ..clock import Clock
from ..linalg import UpperTriangle, factorisation
from ..linalg.definite import STEPS
from ..matrix import OperatorMatrix
from ..recovery import PlanarMesh
from ..tolerances import LAST_DIGITS, SUMMED
from .again import Held, Plain


def unscaled(held: Held, plain: Plain, clock: Clock) -> PlanarMesh | None:
    """The mesh of S c L S; None where no positive vector is annihilated."""
    matrix = held.matrix
    with clock("scaling"):
        null = positive_null_vector(matrix)
    if null is None:
        return None
    null = null / np.exp(np.log(null).mean())
    i, j = matrix.edges.T
    left = replace(matrix, entries=matrix.entries * null[i] * null[j], diagonal=matrix.diagonal * null**2)
    found = plain(left)
    note = "S and c are known up to a factor that one could give the other: the geometric mean of S is 1"
    jacobi = np.ptp(matrix.diagonal) <= SUMMED * np.abs(matrix.diagonal).max()
    more = ("the diagonal is constant, as Jacobi scaling leaves it",) if jacobi else ()
    return held.with_terms(found, Terms(matrix.diagonal, scaling=1 / null), "S c L S", note, *more)


def positive_null_vector(matrix: OperatorMatrix) -> NDArray[np.float64] | None:
    """(n,) a vector of positive numbers that the matrix annihilates up to rounding, if there is one."""
    sign = np.sign(matrix.diagonal)
    if not (sign[0] and (sign == sign[0]).all()):
        return None
    unit = 1 / np.sqrt(np.abs(matrix.diagonal))
    scaled = sp.csr_array(sp.diags_array(unit) @ (sign[0] * matrix.csr()) @ sp.diags_array(unit))
    shifted = UpperTriangle.of(sp.csr_array(scaled + LAST_DIGITS * sp.eye_array(matrix.n)))
    factor = factorisation(shifted)
    try:
        factor.factorise(shifted)
        x = np.ones(matrix.n)
        for _ in range(STEPS + 1):
            x = factor.solve(x)
            x = x / np.abs(x).max()
    finally:
        factor.release()
    if not np.isfinite(x).all():
        return None
    x = x * np.sign(x[0])
    size = abs(scaled) @ np.abs(x)
    return unit * x if (x > 0).all() and (np.abs(scaled @ x) <= SUMMED * size).all() else None
