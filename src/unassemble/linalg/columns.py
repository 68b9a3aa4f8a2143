"""Least-squares problems with columns of length 1, in which one threshold serves all unknowns."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import SolverError


def with_unit_columns(matrix: sp.csr_array) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """The matrix (m, k) with columns of length 1, and what they were multiplied by, (k,).

    Raises
    ------
    SolverError
        If a column is zero or not finite.
    """
    size = np.sqrt(np.asarray(matrix.multiply(matrix).sum(axis=0)).ravel())
    if not (np.isfinite(size).all() and size.all()):
        raise SolverError("a least-squares problem has columns that are zero or not finite")
    unit = 1 / size
    return sp.csr_array(matrix @ sp.diags_array(unit)), unit
