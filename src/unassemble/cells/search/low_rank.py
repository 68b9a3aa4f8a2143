"""Conformal maps after small changes of the labels, by low-rank updates of one factorisation.

A cell f more or less changes M(s) = c L / 2 - s T by T_f, in the rows of its corners only, and the conformal map is
linear in that. Let z be the map at hand, T' = T + T_f, and G the columns of M(s)^-1 that belong to the corners:

    M'^-1 T' z = y + G q,    y = M^-1 T z,    q = (1 - s T_f G_f)^-1 T_f (z + s y)_f,

z_f being the rows of z, and G_f those of G, of the corners. That is one step of inverse iteration on the changed
pencil, and nothing in it is linearised: a change may well move vertices by more than an edge. A thousand changes cost
as much as some tens of solves.
"""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...errors import GeometryError
from ...linalg import factorisation
from ...topology.keys import runs
from ..relax.sheet import Sheet

Move = tuple[int, ...]
"""Candidates whose labels are turned over together."""


def turned(labels: NDArray[np.bool_], move: Move) -> NDArray[np.bool_]:
    """The labels (cells,) after a move."""
    after = labels.copy()
    after[list(move)] ^= True
    return after


class ChangedMaps:
    """Conformal maps after small changes of some labels.

    M(s) is factorised once, and what columns of its inverse have been asked for are kept.

    `labels` (cells,); `near`: of the shift, relative, to the c of their map.

    Raises RecoveryError if there is no conformal map.
    """

    def __init__(self, sheet: Sheet, labels: NDArray[np.bool_], near: float):
        strength = labels.astype(np.float64)
        placed = sheet.mapped(strength)
        pencil = sheet.pencil(strength)
        self._cells = sheet.candidates.cells
        self._shift = (1 - near) * placed.scale
        self._n = sheet.n_vertices
        matrix = pencil.matrix(self._shift)
        self._factor = factorisation(matrix)
        self._factor.factorise(matrix)
        z = placed.z - placed.z[-1]  # the last vertex is pinned
        y = np.append(self._factor.solve(pencil.area_form(z)[:-1]), 0)
        size = np.abs(y).max()
        if not size > 0:
            raise GeometryError("the map covers no area")
        self._z, self._y = z / size, y / size
        self._place = np.full(self._n, -1)
        self._columns = np.empty((0, self._n), dtype=np.complex128)

    def after(self, labels: NDArray[np.bool_], moves: Sequence[Move]) -> NDArray[np.complex128]:
        """(n, moves) positions after each move; NaN where the changed pencil is singular."""
        corner, after, before, side = self._sides(labels, moves)
        new = np.unique(corner)
        new = new[self._place[new] < 0]
        if len(new):  # columns of the inverse
            unit = np.zeros((self._n - 1, len(new)), dtype=np.complex128)
            kept = new < self._n - 1
            unit[new[kept], np.flatnonzero(kept)] = 1
            columns = np.zeros((len(new), self._n), dtype=np.complex128)
            columns[:, :-1] = self._factor.solve(unit).T
            self._place[new] = len(self._columns) + np.arange(len(new))
            self._columns = np.concatenate([self._columns, columns])
        place = self._place[corner]
        inverse = (
            self._columns[place[:, None, :], after[:, :, None]] - self._columns[place[:, None, :], before[:, :, None]]
        )
        changed = np.eye(corner.shape[1]) - self._shift * side[:, :, None] * inverse
        ahead = self._z + self._shift * self._y
        rhs = (side * (ahead[after] - ahead[before]))[..., None]
        q = _solved(changed, rhs)[..., 0]
        scattered = sp.csr_array(
            (q.ravel(), place.ravel(), np.arange(0, q.size + 1, corner.shape[1])), shape=(len(q), len(self._columns))
        )
        return np.asarray(self._y[:, None] + self._columns.T @ scattered.T)

    def _sides(self, labels: NDArray[np.bool_], moves: Sequence[Move]) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Corners of the cells of each move (moves, k), those after and before them, and a factor of their sides.

        The area form of a cell times z is side (z_after - z_before). Rows are filled up with corners of no factor.
        """
        cell = np.concatenate(moves)
        move = np.repeat(np.arange(len(moves)), [len(one) for one in moves])
        size = self._cells.size[cell]
        owner, step = runs(size)
        row = move[owner]
        slot = np.arange(len(row)) - np.searchsorted(row, np.arange(len(moves)))[row]
        corner, after, before = np.zeros((3, len(moves), int(slot.max()) + 1), dtype=np.int64)
        for whose, ahead in ((corner, 0), (after, 1), (before, -1)):
            whose[row, slot] = self._cells.vertices[self._cells.offsets[cell][owner] + (step + ahead) % size[owner]]
        side = np.zeros(corner.shape, dtype=np.complex128)
        side[row, slot] = np.where(labels[cell], 0.25j, -0.25j)[owner]
        return corner, after, before, side


def _solved(matrices: NDArray, rhs: NDArray) -> NDArray[np.complex128]:
    """Solutions of many small systems; NaN where one is singular."""
    try:
        return np.asarray(np.linalg.solve(matrices, rhs))
    except np.linalg.LinAlgError:  # the end of all others, too
        singular = np.linalg.det(matrices) == 0
        return np.asarray(np.linalg.solve(np.where(singular[:, None, None], np.nan, matrices), rhs))
