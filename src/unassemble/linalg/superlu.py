"""SuperLU, which ships with scipy: the factorisation where PARDISO has no wheels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from ..errors import SolverError
from .upper import UpperTriangle


class SuperLUFactorisation:
    """The same interface as :class:`~unassemble.linalg.pardiso.PardisoFactorisation`.

    SuperLU orders and factorises in one go, so nothing is kept between factorisations.
    """

    def __init__(self, matrix: UpperTriangle, *, definite: bool = False):
        self._complex = np.iscomplexobj(matrix.data)

    def factorise(self, matrix: UpperTriangle) -> None:
        """Factorise."""
        if not np.isfinite(matrix.data).all():
            raise SolverError("a matrix to be factorised has entries that are not finite")
        # Minimum degree on A + A' with diagonal pivots preferred: SuperLU users' guide, "symmetric mode".
        try:
            self._lu = splu(
                matrix.full(),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.001,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise SolverError(f"SuperLU could not go on with a matrix of order {matrix.n}: {error}") from error

    def solve(self, rhs: NDArray) -> NDArray:
        """Solve for one right-hand side (n,) or several (n, k)."""
        return self._lu.solve(np.asfortranarray(rhs, dtype=complex if self._complex else float))

    def release(self) -> None:
        """Give the memory of the factor back."""
        self.__dict__.pop("_lu", None)
