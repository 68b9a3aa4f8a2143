"""Positions of all pieces of a body, and how surely they are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...recovery import Evidence


@dataclass(frozen=True, eq=False)
class Solution:
    """Positions of all pieces, and how surely they are known."""

    valid: NDArray[np.bool_]  # (n, d, d) row and column directions whose equations were used
    component: NDArray[np.int64]  # (n,) piece of each node, -1 where not determined
    points: NDArray[np.float64]  # (n, d)
    evidence: tuple[Evidence, ...]
    freedoms: tuple[str, ...]  # what remains free beyond translation and scale, per piece; mostly empty
    exact: bool  # whether all pieces have exact null fields
    warnings: tuple[str, ...]
    planes: bool = False  # whether nodes that lack a direction were taken to lie in planes across it
    straight: tuple[float, ...] = ()  # lambda / mu of the pieces whose axes the identities leave free and elements told
    # (n,) nodes that only equations determine that rest on an assumption, of planes
    hanging: NDArray[np.bool_] | None = None

    @property
    def unique(self) -> bool:
        """Whether what is determined is so up to translation and scale of its piece."""
        return self.exact and not any(self.freedoms)

    @property
    def whole(self) -> bool:
        """Whether every node is determined, up to translation and scale of its piece, and none hangs."""
        return self.unique and bool(np.isfinite(self.firm_points).all())

    @property
    def firm_points(self) -> NDArray[np.float64]:
        """(n, d) the points, NaN where they hang on an assumption that nothing controls."""
        return self.points if self.hanging is None else np.where(self.hanging[:, None], np.nan, self.points)

    @property
    def rank(self) -> tuple[bool, bool, int, int]:
        """For comparison of solutions: exact, unique, and how many coordinates are determined, firmly and at all."""
        firm, points = np.isfinite(self.firm_points).sum(), np.isfinite(self.points).sum()
        return self.exact, not any(self.freedoms), int(firm), int(points)
