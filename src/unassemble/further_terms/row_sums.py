"""Row sums: c L has none, s M the integrals of s times its basis functions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..tolerances import CERTIFIED, SIGMAS


@dataclass(frozen=True, eq=False)
class RowSums:
    """A 1."""

    values: NDArray[np.float64]  # (n,)
    rounding: NDArray[np.float64]  # (n,) about their errors

    @classmethod
    def of(cls, matrix: OperatorMatrix) -> RowSums:
        """Those of a matrix."""
        total = _summed(matrix, np.abs(matrix.diagonal), np.abs(matrix.entries))
        return cls(_summed(matrix, matrix.diagonal, matrix.entries), 4 * np.finfo(float).eps * total)

    @property
    def there(self) -> NDArray[np.bool_]:
        """(n,) those beyond rounding."""
        return np.asarray(np.abs(self.values) > SIGMAS * self.rounding)

    @property
    def sign(self) -> int:
        """Of all that are beyond rounding, if these are the most and have one sign; else 0.

        Small triangles of graded meshes have integrals that may be lost.
        """
        there = self.there
        signs = np.sign(self.values[there])
        return int(signs[0]) if 2 * there.sum() > len(there) and np.ptp(signs) == 0 else 0

    def positive(self) -> NDArray[np.float64]:
        """(n,) their sizes, at least those of rounding."""
        return np.maximum(np.abs(self.values), self.rounding)

    def trust(self) -> NDArray[np.float64]:
        """(n,) weights, less than 1 where a sum has lost so many digits that a certificate could notice."""
        return np.minimum(1.0, CERTIFIED * self.positive() / self.rounding)


def _summed(matrix: OperatorMatrix, diagonal: NDArray, entries: NDArray) -> NDArray[np.float64]:
    i, j = matrix.edges.T
    return np.asarray(diagonal + np.bincount(i, entries, matrix.n) + np.bincount(j, entries, matrix.n))
