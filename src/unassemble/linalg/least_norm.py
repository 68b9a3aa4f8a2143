"""Of all least-squares solutions of a sparse system that of least norm."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from ..errors import SolverError


def least_norm(matrix: sp.csr_array, right: NDArray) -> NDArray[np.complex128]:
    """Solve min |B x - r|, of all such x the shortest one, by proximal iteration.

    Steps minimise |B d - (r - B x)|^2 + w^2 |d|^2. From x = 0 all of them lie in the row space of B, in which they
    converge by a factor w^2 / (w^2 + s^2) for each singular value s. Rounding adds to the null space as what no x
    explains is large: where B x = r has a solution, it adds next to nothing.

    `matrix` (m, k): B, complex; `right` (m,): r. Raises SolverError if the factorisation breaks down.
    """
    rows, columns = matrix.shape
    size = np.sqrt(np.asarray(abs(matrix).power(2).sum(axis=0)).ravel())
    # Singular values below this need many rounds.
    damping = (1e-6 * float(size.max(initial=0.0))) ** 2 or 1.0
    adjoint = matrix.conj().T.tocsr()
    blocks = [[sp.eye_array(rows), matrix], [adjoint, -damping * sp.eye_array(columns)]]
    try:
        factor = splu(sp.block_array(blocks, format="csc"), diag_pivot_thresh=1.0)
    except RuntimeError as error:
        raise SolverError(f"SuperLU could not go on with a matrix of order {rows + columns}: {error}") from error
    found = np.zeros(columns, dtype=np.complex128)
    none, before = found, np.inf
    for _ in range(100):
        step = factor.solve(np.concatenate([right - matrix @ found, none]))[rows:]
        length = float(np.linalg.norm(step))
        if not length < 0.95 * before:
            break
        found, before = found + step, length
    return found
