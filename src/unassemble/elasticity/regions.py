"""Regions of rows whose directions agree among themselves, but not with those of other regions."""

from __future__ import annotations

from itertools import permutations
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

_ROUNDING = 1e-9
_REGIONS = 12  # at most, to be looked at


class Search(Protocol):
    """A search for directions that can be resumed."""

    def reconsider(self, direction: NDArray) -> NDArray:
        """Let every node choose again until nothing changes."""


def exchanged(search: Search, matrix: sp.csr_array, group: NDArray, direction: NDArray, d: int) -> NDArray[np.int64]:
    """Exchange the names of directions in whole regions where more rows annihilate constants then.

    Regions that were labelled from different sides can disagree about names. No row wants to change then but those
    in between; within a region all rows annihilate constants, which shows where it ends.
    """
    failing = int(_failing(matrix, direction, d).sum())
    improved = failing > 0
    while improved:
        improved = False
        regions = _regions(matrix, group, direction, d)
        for region in regions[1:_REGIONS]:  # the largest keeps its names
            for name in list(permutations(range(d)))[1:]:
                trial = direction.copy()
                trial[region] = np.array(name)[direction[region]]
                for one in (trial, search.reconsider(trial)):
                    left = int(_failing(matrix, one, d).sum())
                    if left < failing:
                        direction, failing, improved = one, left, True
            if improved:
                break
    return direction


def _failing(matrix: sp.csr_array, direction: NDArray, d: int) -> NDArray[np.bool_]:
    """(N,) rows that do not annihilate constants direction by direction."""
    ones = np.zeros((len(direction), d))
    ones[np.arange(len(direction)), direction] = 1
    return np.asarray(np.abs(matrix @ ones).max(axis=1) > _ROUNDING * abs(matrix).sum(axis=1))


def _regions(matrix: sp.csr_array, group: NDArray, direction: NDArray, d: int) -> list[NDArray]:
    """Rows of connected nodes all of whose rows annihilate constants, direction by direction; largest first."""
    good = np.bincount(group, _failing(matrix, direction, d))[group] == 0
    coo = matrix.tocoo()
    both = good[coo.row] & good[coo.col]
    link = sp.csr_array((np.ones(both.sum(), np.int8), (coo.row[both], coo.col[both])), shape=matrix.shape)
    label = np.where(good, sp.csgraph.connected_components(link, directed=False)[1], -1)
    names, size = np.unique(label[good], return_counts=True)
    regions = [np.flatnonzero(label == names[k]) for k in np.argsort(-size, kind="stable")[:_REGIONS]]
    return [_with_rim(matrix, group, good, region) for region in regions]


def _with_rim(matrix: sp.csr_array, group: NDArray, good: NDArray, region: NDArray) -> NDArray:
    """A region and the nodes next to it, which disagree with those beyond."""
    near = np.unique(matrix[region].indices)
    rim = np.isin(group, group[near[~good[near]]])
    return np.union1d(region, np.flatnonzero(rim))
