"""What cells leave of a matrix, and whether it has no negative eigenvalue."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from ..budget import SAMPLE
from ..tolerances import ROUNDED


def remainder_of(
    given: sp.coo_array, assembled: sp.coo_array, size: NDArray[np.float64], asked: NDArray[np.bool_]
) -> sp.csr_array:
    """What cells leave of the entries between rows that are `asked`, (N,), over the root of the sizes of both rows.

    With the sign of the diagonal. What is rounding is left out. A penalty counts for the size of its row.
    """
    rest = (given.tocsr() - assembled.tocsr()).tocoo()
    own = np.maximum(size, np.abs(rest.diagonal()))
    own = np.where(asked & (own > 0), own, 1.0)
    value = rest.data / np.sqrt(own[rest.row] * own[rest.col])
    there = asked[rest.row] & asked[rest.col] & (np.abs(value) > ROUNDED)
    sign = np.sign(given.diagonal().sum())
    return sp.csr_array((sign * value[there], (rest.row[there], rest.col[there])), shape=rest.shape)


def semidefinite(matrix: sp.csr_array, allowed: float | NDArray[np.float64]) -> bool:
    """Whether no eigenvalue of a symmetric matrix is below minus what is allowed, one number or one for each row.

    By Sylvester's law of inertia: the pivots of the matrix, with as much added to its diagonal, are positive.
    """
    rows = np.unique(matrix.tocoo().row)
    if not len(rows):
        return True
    shift = np.broadcast_to(np.asarray(allowed, dtype=float), matrix.shape[:1])[rows]
    some = sp.csc_array(matrix[rows][:, rows] + sp.diags_array(shift))
    if len(rows) <= SAMPLE // 4:
        return bool(np.linalg.eigvalsh(some.toarray())[0] > 0)
    try:
        factor = splu(some, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # a pivot is zero
        return False
    return bool((factor.U.diagonal() > 0).all() and np.array_equal(factor.perm_r, factor.perm_c))
