"""Triangles and holes of three edges that follow from the numbers alone, one after the other, where c is known.

A side that borders no other cell has one cotangent for all of its weight. Two cotangents a, b of a triangle give the
third, (1 - ab) / (a + b). What that leaves of the weight of its side belongs to the candidate beyond: if it is nothing,
this is a hole, else a cell. So it goes on from edges that lie on one candidate only. A wrong c soon leads to a
contradiction. Where holes lie close together they cut off trees of triangles: their sides border no other cell, so that
one number more follows than there is, and a coincidence to the last digits tells them.
"""

from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from ...tolerances import AGREED, ALIKE, LAST_DIGITS, SIGMAS

_MOST_SCALES = 8
"""Factors that are tried: inner triangles of a lattice agree as well, in a wrong one."""


class ContradictionError(Exception):
    """No choice of cells has these numbers."""


def lone_scales(sides: NDArray[np.int64], weights: NDArray[np.float64]) -> Iterator[float]:
    """The c in which several triangles agree, the most frequent first.

    The cotangents a, b, d of a triangle satisfy ab + bd + da = 1, so that triangles whose three sides border no other
    cell tell c, each by itself.

    `sides` (m, 3): rows of edges; `weights` (e,): -A_ij of each edge.
    """
    a, b, d = weights[sides].T
    square = a * b + b * d + d * a
    scales = np.sort(2 * np.sqrt(square[square > 0]))
    if not len(scales):
        return
    run = np.cumsum(np.append(0, np.diff(scales) > AGREED * scales[1:]))
    size = np.bincount(run)
    start = np.cumsum(size) - size
    for k in np.argsort(-size, kind="stable")[:_MOST_SCALES].tolist():
        if size[k] > 1:
            yield float(np.sign(weights.sum()) * scales[start[k] + size[k] // 2])


def told(sides: NDArray[np.int64], cotangents: NDArray[np.float64]) -> NDArray[np.int8]:
    """(m,) 1 for a cell, -1 for a hole, 0 where it does not follow.

    `sides` (m, 3): edges of each triangle that may be a cell; each edge in one or two of them; `cotangents` (e,): sums
    of the cotangents of the angles facing each edge, 2 w.

    Raises ContradictionError if an edge is left with no cell, or with a weight that no cell has.
    """
    candidates = _Candidates(sides, cotangents)
    candidates.follow()
    state = candidates.state.copy()
    with suppress(ContradictionError):  # on lattices numbers coincide by chance
        while candidates.suppose():
            candidates.follow()
        state = candidates.state
    return state


class _Candidates:
    """Triangles that may be cells, and what those that are settled leave of the edges."""

    def __init__(self, sides: NDArray[np.int64], cotangents: NDArray[np.float64]):
        self.state = np.zeros(len(sides), dtype=np.int8)  # as they are told
        self._settled = np.zeros(len(sides), dtype=bool)  # cells all of whose cotangents are known
        self._sides, self._given, self._left = sides, cotangents, cotangents.copy()
        order = np.argsort(sides, axis=None, kind="stable")
        pair = np.flatnonzero(np.diff(sides.ravel()[order]) == 0)
        one, other = order[pair], order[pair + 1]
        self._across = np.full(sides.shape, -1)  # the same edge as a side, 3 t + k, of another triangle
        self._across.flat[one], self._across.flat[other] = other, one
        self._beyond = np.where(self._across < 0, -1, self._across // 3)

    def _count(self, some: NDArray[np.bool_]) -> NDArray[np.int64]:
        """(e,) how many of some triangles lie at each edge."""
        return np.bincount(self._sides[some].ravel(), minlength=len(self._left))

    def follow(self) -> None:
        """Until nothing more follows from edges that lie on one candidate only."""
        sides, nonzero = self._sides, self._given != 0
        while True:
            live, loose = self._count(self.state >= 0), self._count((self.state >= 0) & ~self._settled)
            nothing = np.abs(self._left) <= ALIKE * (np.abs(self._given) + 1)
            if (nonzero & (live == 0)).any() or (~nothing & (live > 0) & (loose == 0)).any():
                raise ContradictionError
            alone = (loose[sides] == 1) & ((self.state >= 0) & ~self._settled)[:, None]
            beside = (live == 2)[sides]  # a cell that is settled
            none = nothing[sides]
            hole = (self.state == 0) & (alone & beside & none).any(axis=1)
            cell = (self.state == 0) & (alone & np.where(beside, ~none, nonzero[sides])).any(axis=1)
            if (hole & cell).any():
                raise ContradictionError
            two = ((self.state > 0) | cell) & (alone.sum(axis=1) >= 2)
            if not (hole | cell | two).any():
                return
            self.state[hole], self.state[cell] = -1, 1
            own, third = self._left[sides[two]], alone[two].argmin(axis=1)[:, None]
            a, b = (np.take_along_axis(own, (third + turn) % 3, axis=1) for turn in (1, 2))
            if (a + b <= 0).any():  # two angles of pi or more
                raise ContradictionError
            np.put_along_axis(own, third, (1 - a * b) / (a + b), axis=1)
            self._left -= np.bincount(sides[two].ravel(), own.ravel(), len(self._left))
            self._settled |= two

    def suppose(self) -> bool:
        """Take for cells what is cut off by holes all around: trees of up to six triangles; whether there are any.

        Behind a side of a triangle lies nothing, or one with nothing beyond its other sides; what two of these leave of
        the weights gives the cotangent at the third. Two trees, or a tree and nothing, may have a side between them.
        """
        open_ = np.append((self.state >= 0) & ~self._settled, False)
        certain = np.append(self.state > 0, False)
        left, inexact = self._left[self._sides][..., None], LAST_DIGITS * np.abs(self._given)[self._sides][..., None]
        bare = np.where((open_ & certain)[self._beyond], np.nan, left[..., 0])[..., None]
        beyond, error = bare, inexact  # (m, 3, options)
        for _ in range(2):
            a, da = (np.roll(of, -1, axis=1)[..., None] for of in (beyond, error))
            b, db = (np.roll(of, 1, axis=1)[..., None, :] for of in (beyond, error))
            with np.errstate(all="ignore"):
                third = (1 - a * b) / (a + b)
                spread = ((1 + b * b) * da + (1 + a * a) * db) / (a + b) ** 2 + LAST_DIGITS * np.abs(third)
            good = open_[:-1, None, None, None] & (a + b > 0) & (spread < AGREED * (1 + np.abs(third)))
            third, spread = (of.reshape(*left.shape[:2], -1) for of in (np.where(good, third, np.nan), spread))
            across = [np.vstack([of.reshape(left.size, -1), np.full(of.shape[2], np.nan)]) for of in (third, spread)]
            beyond = np.concatenate([bare, left - across[0][self._across]], axis=2)
            error = np.concatenate([inexact, inexact + across[1][self._across]], axis=2)
        agree = np.abs(third[..., None] - beyond[..., None, :]) <= SIGMAS * (spread[..., None] + error[..., None, :])
        triangle, side, within, outside = np.nonzero(agree)
        cells, holes = self._tree(triangle, side, within)
        arc = np.where(outside > 0, self._across[triangle, side], -1)
        other, its = self._tree(np.where(arc < 0, -1, arc // 3), arc % 3, outside - 1)
        holes = np.column_stack([holes, its, np.where(outside > 0, -1, self._beyond[triangle, side])])
        cells = np.column_stack([cells, other])
        disputed = _marked(cells, len(open_)) & _marked(holes, len(open_))
        fine = ~(disputed[cells].any(axis=1) | disputed[holes].any(axis=1))
        cell, hole = (_marked(of[fine], len(open_)) & open_ & ~certain for of in (cells, holes))
        self.state[cell[:-1]], self.state[hole[:-1]] = 1, -1
        return bool((cell | hole).any())

    def _tree(self, triangle: NDArray, side: NDArray, which: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Cells (k, 3) of trees that end with a side of a triangle, and holes (k, 6) around them; -1 for none."""
        cells, holes = [triangle], []
        beyond, across = (np.append(of, [[-1] * 3], axis=0) for of in (self._beyond, self._across))
        for turn, more in ((1, which // 2 == 1), (2, which % 2 == 1)):
            arc = across[triangle, (side + turn) % 3]
            cells.append(np.where(more, beyond[triangle, (side + turn) % 3], -1))
            holes.append(np.where(more, -1, beyond[triangle, (side + turn) % 3]))
            holes += [np.where(more, beyond[cells[-1], (arc + further) % 3], -1) for further in (1, 2)]
        return np.column_stack(cells), np.column_stack(holes)


def _marked(rows: NDArray[np.int64], size: int) -> NDArray[np.bool_]:
    """(size,) whether each is among some rows; not the last, which stands for none."""
    marked = np.zeros(size, dtype=bool)
    marked[rows] = True
    marked[-1] = False
    return marked
