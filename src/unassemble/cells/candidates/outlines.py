"""Outlines of what may be cells, in array form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Outlines:
    """Cycles of vertices, and the half-edges that each takes up.

    Attributes
    ----------
    size : (k,) int64
        Vertices of each.
    vertices : (sum of size,) int64
        One after the other.
    sides : (s, 2) int64
        Pairs (outline, half-edge).
    """

    size: NDArray[np.int64]
    vertices: NDArray[np.int64]
    sides: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.size)
