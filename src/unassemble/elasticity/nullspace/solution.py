"""Positions of all pieces of a body, and how surely they are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..results import Evidence


@dataclass(frozen=True, eq=False)
class Solution:
    """Positions of all pieces, and how surely they are known.

    Attributes
    ----------
    valid : (n, d, d) bool
        Row and column directions whose equations were used.
    component : (n,) int64
        Piece of each node, -1 where not determined.
    points : (n, d) float64
    evidence : tuple of Evidence
    freedoms : tuple of str
        What remains free beyond translation and scale, per piece; mostly empty.
    exact : bool
        Whether all pieces have exact null fields.
    warnings : tuple of str
    ratio : float or None
        lambda / mu, where it was used.
    strict : bool
        Whether rows were judged by the strict rule.
    planes : bool
        Whether nodes that lack a direction were taken to lie in planes across it.
    straight : tuple of float
        lambda / mu of the pieces whose axes the identities leave free and elements told; see :mod:`.straight`.
    firm : (n, d) float64, optional
        Points that rows with enough equations place, from which others were placed; see :mod:`.extending`.
    leaning : (n,) bool, optional
        Nodes that have a place only because others were taken to lie in planes, or Poisson's ratio to be one number.
    """

    valid: NDArray[np.bool_]
    component: NDArray[np.int64]
    points: NDArray[np.float64]
    evidence: tuple[Evidence, ...]
    freedoms: tuple[str, ...]
    exact: bool
    warnings: tuple[str, ...]
    ratio: float | None = None
    strict: bool = True
    planes: bool = False
    straight: tuple[float, ...] = ()
    firm: NDArray[np.float64] | None = None
    leaning: NDArray[np.bool_] | None = None

    @property
    def unique(self) -> bool:
        """Whether what is determined is so up to translation and scale of its piece."""
        return self.exact and not any(self.freedoms)

    @property
    def hanging(self) -> bool:
        """Whether all points, and not those of some nodes only, hang on what was assumed."""
        known = np.isfinite(self.points).all(axis=1)
        return self.leaning is not None and bool(known.any()) and bool(self.leaning[known].all())

    @property
    def whole(self) -> bool:
        """Whether every node is determined, up to translation and scale of its piece."""
        return self.unique and bool(np.isfinite(self.points).all())

    @property
    def rank(self) -> tuple[bool, bool, int]:
        """For comparison of solutions: exact, unique, and how many coordinates are determined."""
        return self.exact, not any(self.freedoms), int(np.isfinite(self.points).sum())
