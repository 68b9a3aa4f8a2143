"""The certificate of a mesh with more vertices than the matrix has rows: it gives back what the rows have of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..certify import Certificate
from ..matrix import OperatorMatrix


@dataclass(frozen=True, eq=False)
class Witness:
    """How well a mesh explains the rows that are left of its matrix.

    Attributes
    ----------
    entries : float
        Largest difference of an off-diagonal entry, relative to the largest off-diagonal entry of its row.
    diagonal : float
        The same of diagonal entries, which say how much is gone.
    upright : bool
        Whether no triangle is flat or turned over.
    """

    entries: float
    diagonal: float
    upright: bool

    @property
    def backward_error(self) -> float:
        """The larger of both; infinite where a triangle is turned over."""
        return max(self.entries, self.diagonal) if self.upright else np.inf

    @classmethod
    def of(cls, matrix: OperatorMatrix, found: Certificate, n_points: int, shift: float) -> Witness:
        """Compare rows and columns of the matrix.

        Parameters
        ----------
        matrix : OperatorMatrix
        found : Certificate
            Of a mesh that has the rows first among its points.
        n_points : int
        shift : float
            Multiple of the identity that was added.
        """
        n = matrix.n
        within = (found.pairs < n).all(axis=1)
        sums = np.zeros(n)
        for end in matrix.edges.T:
            sums += np.bincount(end, matrix.entries, n)
        for end in found.pairs.T:
            sums += np.bincount(end, found.differences, n_points)[:n]
        diagonal = np.abs(shift - sums - matrix.diagonal) / matrix.row_size
        return cls(float(found.misfits[within].max()), float(diagonal.max()), not len(found.flipped))
