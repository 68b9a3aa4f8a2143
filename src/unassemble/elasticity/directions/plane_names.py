"""Directions of nodes on rollers, plane by plane, by sums alone.

Whole nodes next to one plane of rollers have neighbours that all lack the same direction. There are d guesses which,
and the right one makes the sums over all other directions vanish. That holds however stiff the material is against a
change of volume, where the directions of least energy are others.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..rows.constants import ROUNDING, least_sums, row_sizes, with_penalty


def named_by_sums(
    matrix: sp.csr_array,
    run: NDArray[np.int64],
    direction: NDArray[np.int64],
    d: int,
    rounding: float | NDArray[np.float64] = ROUNDING,
) -> NDArray[np.int64]:
    """Directions of rows that stand node by node, those that sums tell set right.

    Nodes with all their rows are known from the order; then those that lack one direction, then two.

    Parameters
    ----------
    matrix : (N, N) sparse
        Symmetric, entries that vanish stored.
    run : (N,) int64
        Neighbouring rows that couple to the same unknowns: one node, if there are at most d of them.
    direction : (N,) int64
        The likeliest.
    d : int
    rounding : float or (N,) float64
        Of its size: what entries of a row add up to that make up zero.
    """
    direction = direction.copy()
    length = np.bincount(run)[run]
    place = np.arange(len(run)) - np.searchsorted(run, run)
    named = length == d
    direction[named] = place[named]
    sums = _Sums(matrix, run, length == d, rounding)
    for count in range(d - 1, 0, -1):
        names = np.array(list(combinations(range(d), count)))
        lacking = length == count
        while True:
            told = sums.told(lacking & ~named, np.where(named, direction, -1), place, names)
            if not (told >= 0).any():
                break
            new = told >= 0
            direction[new] = names[told[new], place[new]]
            named |= new
    return direction


class _Sums:
    """Which guesses make sums vanish in whole nodes."""

    def __init__(
        self,
        matrix: sp.csr_array,
        run: NDArray[np.int64],
        whole: NDArray[np.bool_],
        rounding: float | NDArray[np.float64],
    ):
        self._matrix, self._run, self._whole = matrix, run, whole
        size = row_sizes(matrix)
        self._least, self._penalised = least_sums(size, rounding), with_penalty(matrix, size)
        entry = matrix.tocoo()
        strong = np.abs(entry.data) > self._least[entry.row]
        self._pattern = sp.csr_array((np.ones(strong.sum()), (entry.row[strong], entry.col[strong])), matrix.shape)

    def told(
        self, rows: NDArray[np.bool_], direction: NDArray[np.int64], place: NDArray[np.int64], names: NDArray[np.int64]
    ) -> NDArray[np.int64]:
        """(N,) which names sums tell for the rows of nodes, the place of each row in its node given; -1 where none."""
        near = self._whole & (self._pattern @ rows.astype(float) > 0)
        passing = np.stack([near & self._vanishing(rows, direction, place, some) for some in names])
        alone = passing & (passing.sum(axis=0) == 1)
        votes = np.zeros((len(names), int(self._run.max()) + 1))
        for k, one in enumerate(alone):
            votes[k] = np.bincount(self._run, self._pattern.T @ one.astype(float))
        best = np.where((votes > 0).sum(axis=0) == 1, votes.argmax(axis=0), -1)
        return np.where(rows, best[self._run], -1)

    def _vanishing(
        self, rows: NDArray[np.bool_], direction: NDArray[np.int64], place: NDArray[np.int64], some: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """(N,) rows of nodes in which the sums over some directions vanish, if these are those of the rows guessed."""
        guess = np.where(rows, some[np.minimum(place, len(some) - 1)], direction)
        label = (guess[:, None] == some).astype(float)
        excused = self._penalised[:, None] & (label > 0)
        failing = ((np.abs(self._matrix @ label) > self._least[:, None]) & ~excused).any(axis=1)
        return np.asarray(np.bincount(self._run, failing)[self._run] == 0)
