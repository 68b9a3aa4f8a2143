"""Errors of the entries, where their size is known: it is given, or the entries show to what they were rounded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..matrix.digits import Digits
from ..matrix.operator import row_sizes
from ..tolerances import SMALL
from ..topology import Topology
from ..topology.keys import pair_keys


@dataclass(frozen=True, eq=False)
class Noise:
    """Independent errors of known size in the stored entries."""

    sigma: float  # standard deviation of those of typical entries
    spread: NDArray[np.float64]  # (e,) standard deviations, over `sigma`
    digits: str | None = None  # what the entries were rounded to; None where the noise was given
    # how often an error occurs, in the mean over the entries: entries that are equal were rounded alike
    repeats: float = 1.0
    different: float = 1.0  # share of the entries that are not equal to others

    @classmethod
    def known(cls, matrix: OperatorMatrix, sigma: float | None) -> Noise | None:
        """That of a given standard deviation, or else of entries that have been rounded."""
        if sigma is not None:
            return cls(sigma, np.ones(len(matrix.edges)))
        if (digits := Digits.of(matrix.entries)) is None:
            return None
        # Zeros, and what cancelling leaves, are exact to the rounding of assembly, which that of larger entries tells.
        unit = digits.unit
        largest = row_sizes(matrix.n, matrix.edges, unit)[matrix.edges].min(axis=1)
        # An error between -u / 2 and u / 2, evenly distributed, has the standard deviation u / sqrt(12).
        error = np.maximum(unit, SMALL * largest) / np.sqrt(12)
        rounded = unit > 0
        error = np.maximum(error, SMALL * error[rounded].min())  # rows of whole numbers show no rounding at all
        sigma = float(np.median(error[rounded]))
        count = np.unique(np.abs(matrix.entries[rounded]), return_counts=True)[1]
        repeats, different = np.sum(count**2) / np.sum(count), len(count) / np.sum(count)
        return cls(sigma, error / sigma, digits.name, float(repeats), float(different))

    def __str__(self) -> str:
        size = f"noise of standard deviation {self.sigma:.3g} (absolute)"
        return f"rounding to {self.digits}" if self.digits else size

    def at(self, pairs: NDArray[np.int64], stored: OperatorMatrix) -> NDArray[np.float64]:
        """(k,) standard deviations of entries at `pairs` (k, 2), those that are stored among them."""
        if len(pairs) == len(self.spread):
            return self.sigma * self.spread
        spread = np.ones(len(pairs))
        keys = pair_keys(stored.n, *pairs.T)
        spread[np.searchsorted(keys, pair_keys(stored.n, *stored.edges.T))] = self.spread
        return self.sigma * spread


def with_vanished(topology: Topology, noise: Noise | None) -> NDArray[np.float64]:
    """(e',) standard deviations over sigma of all entries, those included that have vanished and are exact."""
    result = np.full(len(topology.edges), SMALL)
    result[np.delete(np.arange(len(result)), topology.vanished)] = 1.0 if noise is None else noise.spread
    return result
