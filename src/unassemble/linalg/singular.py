"""Singular values and vectors of dense matrices."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray


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
