"""Candidates whose labels are turned over together, and which candidates touch or exclude each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..relax.sheet import Sheet

Move = tuple[int, ...]


def turned(labels: NDArray[np.bool_], move: Move) -> NDArray[np.bool_]:
    """The labels (cells,) after a move."""
    after = labels.copy()
    after[list(move)] ^= True
    return after


class Neighbours:
    """What is near what among the candidates of a sheet."""

    def __init__(self, sheet: Sheet):
        n, count = sheet.n_vertices, sheet.candidates.count
        corner = _incidence(np.repeat(sheet.cell, 3), sheet.triangles.ravel(), (count, n))
        self._touching = (corner @ corner.T).tocsr()
        cell, half = sheet.candidates.sides.T
        taken = _incidence(cell, half, (count, 2 * len(sheet.candidates.edges)))
        rivals = (taken @ taken.T).tocsr()
        self._rivals = [own.tolist() for own in np.split(rivals.indices, rivals.indptr[1:-1])]

    def touching(self, move: Move) -> list[int]:
        """Candidates that share a vertex with one of the move."""
        indices, start = self._touching.indices, self._touching.indptr
        return sorted({int(k) for cell in move for k in indices[start[cell] : start[cell + 1]]})

    def with_rivals(self, labels: Sequence[bool] | NDArray[np.bool_], cells: Sequence[int]) -> Move:
        """The cells, and those that have to give way to the new ones among them."""
        gone = {other for k in cells if not labels[k] for other in self._rivals[k] if labels[other]}
        return tuple(sorted({*cells} | gone))


def _incidence(row: NDArray, column: NDArray, shape: tuple[int, int]) -> sp.csr_array:
    return sp.csr_array((np.ones(len(row)), (row, column)), shape=shape)
