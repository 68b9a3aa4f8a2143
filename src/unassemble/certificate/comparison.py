"""Entries of a mesh, assembled again, compared with those of the matrix, each relative to its own row."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..tolerances import CERTIFIED


@dataclass(frozen=True, eq=False)
class Terms:
    """What a matrix S (c L + s M) S has besides c L, and nothing else on its diagonal."""

    diagonal: NDArray[np.float64]  # (n,) A_ii of the matrix
    reaction: float = 0.0  # s
    lumped: bool = False  # whether M is diagonal: the sums of the consistent one's rows
    scaling: NDArray[np.float64] | None = None  # (n,) S; the identity by default


@dataclass(frozen=True, eq=False)
class Certificate:
    """How well a mesh explains a matrix."""

    # largest difference between an off-diagonal entry and the re-assembled one, relative to the largest off-diagonal
    # entry of its row
    backward_error: float
    # (k, 2) rows and columns of all entries of either, upper triangle; with further terms the diagonal as well
    pairs: NDArray[np.int64]
    misfits: NDArray[np.float64]  # (k,) their differences, relative in the same way
    differences: NDArray[np.float64]  # (k,) re-assembled minus given
    flipped: NDArray[np.int64]  # (f,) cells that are flat or turned over: with any of them a mesh is not planar

    def counts(self) -> dict[str, int]:
        """How many entries were compared, and how many of them are given back, as fields of a result."""
        return {
            "n_entries": len(self.misfits),
            "n_fitting": int(np.count_nonzero(self.misfits <= CERTIFIED)),
        }

    def worst(
        self, count: int = 10, *, noise: NDArray | None = None, first: NDArray | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The entries that fit worst, worst first, and their misfits.

        Those above the bound, by misfit relative to the row; or, for noise of standard deviations (k,), those off by
        more than three of them, by that. Pairs `first`, (k, 2) with i < j, come before all others.
        """
        size = self.misfits if noise is None else np.abs(self.differences) / noise
        above = np.flatnonzero(size > (CERTIFIED if noise is None else 3))
        order = above[np.argsort(-size[above], kind="stable")][:count]
        if first is not None and len(first):
            n = int(self.pairs.max()) + 1
            key = self.pairs[:, 0] * n + self.pairs[:, 1]  # ascending
            leading = np.searchsorted(key, first[:, 0] * n + first[:, 1])
            order = np.concatenate([leading, order[~np.isin(order, leading)]])[:count]
        return self.pairs[order], self.misfits[order]


def compared(
    n: int,
    edges: NDArray,
    entries: NDArray,
    places: tuple[NDArray, NDArray],
    values: NDArray,
    flipped: NDArray,
    terms: Terms | None = None,
) -> Certificate:
    """The entries of a mesh of n points, added up of values at rows i and columns j >= i, against those of a matrix."""
    summed = sp.coo_array((values, places), shape=(n, n)).tocsr()
    summed.sort_indices()
    key, value = np.repeat(np.arange(n), np.diff(summed.indptr)) * n + summed.indices, summed.data
    if terms is not None and terms.scaling is not None:
        value = value * terms.scaling[key // n] * terms.scaling[key % n]
    given = edges[:, 0] * n + edges[:, 1]
    if terms is not None:
        given, order = np.unique(np.concatenate([given, np.arange(n) * (n + 1)]), return_index=True)
        edges, entries = np.column_stack([given // n, given % n]), np.concatenate([entries, terms.diagonal])[order]
    if np.array_equal(key, given):
        pairs, difference = edges, value - entries
    else:
        both = np.sort(np.concatenate([key, given]))
        union = both[np.append(True, both[1:] != both[:-1])]
        difference = np.zeros(len(union))
        difference[np.searchsorted(union, key)] += value
        difference[np.searchsorted(union, given)] -= entries
        pairs = np.column_stack([union // n, union % n])
    size = np.zeros(n)
    apart = edges[:, 0] != edges[:, 1]
    for end in edges[apart].T:
        np.maximum.at(size, end, np.abs(entries[apart]))
    reference = np.minimum(size[pairs[:, 0]], size[pairs[:, 1]])
    misfits = relative(difference, reference)
    return Certificate(float(misfits.max(initial=0.0)), pairs, misfits, difference, flipped)


def relative(difference: NDArray, reference: NDArray) -> NDArray[np.float64]:
    """Absolute difference relative to a reference; infinite where it is not a number."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(difference == 0, 0.0, np.abs(difference) / reference)
    return np.where(np.isnan(ratio), np.inf, ratio)
