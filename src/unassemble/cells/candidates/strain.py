"""How far angles of cells are from adding up, and labels changed so that they are less; nothing is solved for it.

Candidates that want the same half-edge may be believed in alike, as the two corners are that a lone edge has room for.
What they leave to the cells around tells them apart: an edge is shared by two cells, or has all of its weight from one.
"""

from __future__ import annotations

from collections import deque

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .angles import facing_angles
from .candidates import Candidates

_LEFT_OUT = 0.05  # squared excess of an angle sum, in units of pi, above which a short face may be left out
_BARE = 1.0  # that counts as much as an edge without a cell
_STRAINED = 1e-3  # the same, of cells about which changes are tried
_FEW = 0.1  # part of all cells
_LEAST = 1e-6  # by which a change has to lessen the strain
_LONGEST = 100  # changes one after the other
_MOST_TRIALS = 3000


def strain(candidates: Candidates, labels: NDArray[np.bool_]) -> float:
    """How far the angles of some cells are from adding up to pi, edges between two of them shared equally.

    Squares of the excess in units of pi. Short faces left out add a little, or no cells would be best.
    """
    cell, half = candidates.sides[labels[candidates.sides[:, 0]]].T
    used = np.zeros(2 * len(candidates.edges), dtype=bool)
    used[half] = True
    facing = facing_angles(candidates.relative[half >> 1] * np.where(used[half ^ 1], 1, 2))
    angles, sides = np.bincount(cell, facing, candidates.count), np.bincount(cell, minlength=candidates.count)
    excesses = _excesses(angles[labels], sides[labels], candidates.corner[labels], candidates.half[labels])
    return float(excesses.sum()) + _LEFT_OUT * float((candidates.first & ~labels).sum())


def eased(candidates: Candidates, labels: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """(cells,) labels of less strain, where angles do not add up in a few places only; None if there are none.

    Each change is of one candidate, and of those that are in its way, or of two that are next to each other.
    """
    angles = _Angles(candidates, labels)
    strained = labels & (angles.excesses(np.arange(candidates.count)) > _STRAINED)
    if strained.sum() > _FEW * labels.sum():
        return None
    about = angles.near(angles.near(np.flatnonzero(strained)))
    for left_out in (_LEFT_OUT, 0.0):  # whether all short faces are cells is the last question
        _ease(angles, about, left_out)
    return angles.labels if (angles.labels != labels).any() else None


def _ease(angles: _Angles, cells: NDArray[np.int64], left_out: float) -> None:
    """Follow changes of some cells, and of others near those that change, wherever that ends with less strain."""
    waiting = deque(cells.tolist())
    trials = _MOST_TRIALS
    while waiting and trials > 0:
        changed, tried = _followed(angles, waiting.popleft(), left_out)
        waiting.extend(angles.near(np.array(changed, dtype=np.int64)).tolist())
        trials -= tried


def _followed(angles: _Angles, cell: int, left_out: float) -> tuple[list[int], int]:
    """Change labels one after the other until there is less strain, or back; those that change, and cells tried.

    Along a row of corners that stand one place too far each but the last change moves the strain on to the next.
    """
    changed: list[int] = []
    total, tried, nearby = 0.0, 0, [cell]
    for _ in range(_LONGEST):
        options = [angles.best_change(k, left_out, {*changed}) for k in nearby]
        tried += len(nearby)
        more, least = min(options, key=lambda option: option[1])
        if least > _LEAST:
            break
        angles.turn(more)
        changed += more.tolist()
        total += least
        if total < -_LEAST:
            return changed, tried
        nearby = angles.near(more).tolist()
        if not nearby:
            break
    angles.turn(np.array(changed, dtype=np.int64))
    return [], tried


class _Angles:
    """Angles that the sides of cells show, as long as they have these labels.

    Attributes
    ----------
    labels : (cells,) bool
    """

    def __init__(self, candidates: Candidates, labels: NDArray[np.bool_]):
        cell, half = candidates.sides.T
        self._wants = sp.csr_array((np.ones(len(cell)), (cell, half)), (candidates.count, 2 * len(candidates.edges)))
        self._wanted = self._wants.T.tocsr()
        self._shared, self._whole = (facing_angles(share * candidates.relative) for share in (1, 2))
        self._given = candidates.weights != 0
        self._corner, self._half, self._first = candidates.corner, candidates.half, candidates.first
        self._likely = self._corner | self._half | self._first
        self._owner = np.full(self._wants.shape[1], -1)
        self._same = _same_corners(candidates)
        chosen = labels[cell]
        self._owner[half[chosen]] = cell[chosen]
        self.labels = labels.copy()

    def near(self, cells: NDArray[np.int64]) -> NDArray[np.int64]:
        """(k,) candidates with a side along one of these cells, which are among them; no holes of many edges."""
        half = self._wants[cells].indices
        near = np.unique(self._wanted[np.r_[half, half ^ 1]].indices)
        return near[self.labels[near] | self._likely[near]].astype(np.int64)

    def best_change(self, cell: int, left_out: float, settled: set[int]) -> tuple[NDArray[np.int64], float]:
        """The change of a label, with another one or not, that leaves least strain, and how much more; none `settled`.

        What is in the way of new cells is left out.
        """
        best, least = np.empty(0, dtype=np.int64), np.inf
        for change in [{cell}, *({cell, other} for other in self.partners(cell))]:
            every = change | self.in_the_way(change)
            if every & settled:
                continue
            cells = np.array(sorted(every))
            near = self.near(cells)
            before = self.strain(near, left_out)
            self.turn(cells)
            more = self.strain(near, left_out) - before
            self.turn(cells)
            if more < least:
                best, least = cells, more
        return best, least

    def partners(self, cell: int) -> list[int]:
        """Candidates that one does not exclude, along its sides or those of cells in its way."""
        half = self._wants[[cell]].indices
        near = self.near(np.array(sorted({cell} | self.in_the_way({cell}))))
        return np.setdiff1d(near, np.append(self._wanted[half].indices, self._same[cell])).tolist()

    def in_the_way(self, cells: set[int]) -> set[int]:
        """Cells that want half-edges of new ones among these, or are the same triangle beyond."""
        new = [k for k in cells if not self.labels[k]]
        same = self._same[new]
        return {*self._owner[self._wants[new].indices].tolist(), *same[self.labels[same]].tolist()} - {-1} - cells

    def turn(self, cells: NDArray[np.int64]) -> None:
        """Turn labels over; no two of the new cells may want one half-edge."""
        self.labels[cells] ^= True
        out = ~self.labels[cells]
        self._owner[self._wants[cells[out]].indices] = -1
        taken = self._wants[cells[~out]]
        self._owner[taken.indices] = np.repeat(cells[~out], np.diff(taken.indptr))

    def strain(self, cells: NDArray[np.int64], left_out: float) -> float:
        """Of some cells, and of edges along them that border none, with what short faces count that are `left_out`."""
        edges = np.unique(self._wants[cells].indices >> 1)
        bare = self._given[edges] & np.all(self._owner.reshape(-1, 2)[edges] < 0, axis=1)
        short = self._first[cells] & ~self.labels[cells]
        return float(self.excesses(cells).sum() + _BARE * bare.sum() + left_out * short.sum())

    def excesses(self, cells: NDArray[np.int64]) -> NDArray[np.float64]:
        """(k,) squared excess of the angle sum of each, in units of pi; 0 if it is left out."""
        wants = self._wants[cells]
        half = wants.indices
        facing = np.where(self._owner[half ^ 1] < 0, self._whole[half >> 1], self._shared[half >> 1])
        angles = np.add.reduceat(facing, wants.indptr[:-1])
        excesses = _excesses(angles, np.diff(wants.indptr), self._corner[cells], self._half[cells])
        return np.where(self.labels[cells], excesses, 0.0)


def _excesses(angles: NDArray, sides: NDArray, corner: NDArray[np.bool_], half: NDArray[np.bool_]) -> NDArray:
    """(k,) squared excess of angle sums, in units of pi, of cells whose `sides`, (k,), see these angles together.

    A corner has a right angle, and two others, the mean of what its sides show; half circles see one as well.
    """
    sums = np.where(corner, 2 * angles / sides, angles) + np.pi / 2 * (corner | half)
    return np.asarray((sums / np.pi - 1) ** 2)


def _same_corners(candidates: Candidates) -> NDArray[np.int64]:
    """(cells,) the corner on the other side of the same two edges; the candidate itself if there is none."""
    same = np.arange(candidates.count)
    corners = np.flatnonzero(candidates.corner)
    vertices = candidates.cells.vertices[candidates.cells.offsets[corners][:, None] + np.arange(3)]
    ends = np.sort(vertices[:, [0, 2]], axis=1)
    order = np.lexsort((*ends.T, vertices[:, 1]))
    key = np.column_stack([vertices[order, 1], ends[order]])
    pair = np.flatnonzero(np.all(key[1:] == key[:-1], axis=1))
    same[corners[order[pair]]], same[corners[order[pair + 1]]] = corners[order[pair + 1]], corners[order[pair]]
    return same
