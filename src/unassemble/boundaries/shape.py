"""What triangles look like where nothing else is known: sides of about equal length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece


@dataclass(frozen=True, eq=False)
class ShapePrior:
    """log |ab|^2 less the mean of log |bc|^2 and log |ca|^2, for triangles abc on a side ab without a whole entry."""

    corners: NDArray[np.int64]  # (3, m) a, b, c

    @classmethod
    def of(cls, piece: Piece, unknown: NDArray[np.bool_]) -> ShapePrior:
        """For sides marked in `unknown`, (e,) bool."""
        triangle, apex = np.nonzero(unknown[piece.opposite])
        return cls(np.stack([piece.triangles[triangle, (apex + turn) % 3] for turn in (1, 2, 0)]))

    def about(self, vertices: NDArray[np.bool_]) -> ShapePrior:
        """Of triangles with one of these vertices, (n,) bool."""
        return ShapePrior(self.corners[:, vertices[self.corners].any(axis=0)])

    def _sides(self, z: NDArray) -> NDArray[np.complex128]:
        a, b, c = z[self.corners]
        return np.stack([b - a, c - b, a - c])

    def residual(self, z: NDArray) -> NDArray[np.float64]:
        """(m,)."""
        ab, bc, ca = np.log(np.abs(self._sides(z)))
        return np.asarray(2 * ab - bc - ca)

    def gradient(self, z: NDArray) -> NDArray[np.complex128]:
        """(3, m) g with d residual = Re sum_k g_k dz_k over the corners."""
        ab, bc, ca = 1 / self._sides(z)
        return np.stack([-2 * ab - ca, 2 * ab + bc, ca - bc])
