"""Triangles that their numbers make cells or holes one after the other, from the boundary inwards, where c is known.

An edge on one candidate only is a side of a cell, and all of its weight is one cotangent. Two cotangents a, b of a
triangle give the third, (1 - ab) / (a + b). What is left of the weight of that side then belongs to the candidate on
its far side: if it is nothing, this is a hole, else a cell. So it goes on until every triangle that is left has
two sides whose weights may be shared. A wrong c soon leads to a contradiction.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...tolerances import AGREED, ALIKE
from .patches import patches

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


def peeled(sides: NDArray[np.int64], cotangents: NDArray[np.float64]) -> NDArray[np.int8]:
    """(m,) 1 for a cell, -1 for a hole, 0 where it does not follow from the boundary and from patches cut off by holes.

    `sides` (m, 3): edges of each triangle that may be a cell; each edge in one or two of them; `cotangents` (e,): sums
    of the cotangents of the angles facing each edge, 2 w.

    Raises ContradictionError if an edge is left with no cell, or with a weight that no cell has.
    """
    peeling = _Peeling(sides, cotangents)
    peeling.run()
    state = peeling.states
    try:
        while len(rest := np.flatnonzero(peeling.open)):
            cells, holes = patches(sides[rest], peeling.left, np.abs(cotangents), peeling.states[rest])
            if not peeling.assume(rest[cells], rest[holes]):
                break
            peeling.run()
    except ContradictionError:  # on lattices numbers coincide by chance
        return state
    return peeling.states


class _Peeling:
    """States of the triangles, and what is left of the edges."""

    def __init__(self, sides: NDArray[np.int64], cotangents: NDArray[np.float64]):
        self._state = [0] * len(sides)
        self._sides: list[list[int]] = sides.tolist()
        self._known: list[dict[int, float]] = [{} for _ in self._sides]
        self._left: list[float] = cotangents.tolist()
        self._nothing: list[float] = (ALIKE * (np.abs(cotangents) + 1)).tolist()
        self._nonzero: list[bool] = (cotangents != 0).tolist()
        self._at: list[list[int]] = [[] for _ in self._left]
        for triangle, edges in enumerate(self._sides):
            for edge in edges:
                self._at[edge].append(triangle)
        self._waiting: list[int] = []
        for edge in range(len(self._left)):
            self._need(edge)

    @property
    def states(self) -> NDArray[np.int8]:
        """(m,) what is known now."""
        return np.array(self._state, dtype=np.int8)

    @property
    def open(self) -> NDArray[np.bool_]:
        """(m,) all but holes, and cells all of whose cotangents are known."""
        return ~np.array([s < 0 or len(known) == 3 for s, known in zip(self._state, self._known, strict=True)])

    @property
    def left(self) -> NDArray[np.float64]:
        """(e,) what cells all of whose cotangents are known leave of the edges."""
        left = self._left.copy()
        for known in self._known:
            for edge, cotangent in known.items() if len(known) < 3 else ():
                left[edge] += cotangent
        return np.array(left)

    def assume(self, cells: NDArray[np.int64], holes: NDArray[np.int64]) -> bool:
        """Take triangles that are not settled for cells and for holes; whether there are any."""
        settled = self.states != 0
        cells, holes = cells[~settled[cells]], holes[~settled[holes]]
        for triangle in cells.tolist():
            self._take(triangle)
        for triangle in holes.tolist():
            self._leave_out(triangle)
        return bool(len(cells) + len(holes))

    def run(self) -> None:
        """Until nothing more follows."""
        while self._waiting:
            edge = self._waiting.pop()
            live = [t for t in self._at[edge] if self._state[t] >= 0]
            rest = [t for t in live if edge not in self._known[t]]
            if len(rest) < len(live) and abs(self._left[edge]) <= self._nothing[edge]:
                for triangle in rest:
                    if self._state[triangle]:  # its angle there is a right one
                        self._settle(triangle, edge, self._left[edge])
                    else:
                        self._leave_out(triangle)
            elif live and not rest:
                raise ContradictionError
            elif len(rest) == 1 and (len(live) == 2 or self._nonzero[edge]):
                self._take(rest[0])
                self._settle(rest[0], edge, self._left[edge])

    def _need(self, edge: int) -> None:
        """A nonzero weight is a cotangent of some cell: the only one that may be there is one."""
        live = [t for t in self._at[edge] if self._state[t] >= 0]
        if self._nonzero[edge] and not live:
            raise ContradictionError
        if self._nonzero[edge] and len(live) == 1:
            self._take(live[0])
        self._waiting.append(edge)

    def _take(self, triangle: int) -> None:
        if not self._state[triangle]:
            self._state[triangle] = 1
            self._waiting += self._sides[triangle]

    def _leave_out(self, triangle: int) -> None:
        self._state[triangle] = -1
        for edge in self._sides[triangle]:
            self._need(edge)

    def _settle(self, triangle: int, edge: int, cotangent: float) -> None:
        """A cotangent of a cell; the second one gives the third."""
        known = self._known[triangle]
        known[edge] = cotangent
        self._left[edge] -= cotangent
        self._waiting.append(edge)
        if len(known) == 2:
            a, b = known.values()
            if a + b <= 0:  # two angles of pi or more
                raise ContradictionError
            third = next(e for e in self._sides[triangle] if e not in known)
            self._settle(triangle, third, (1 - a * b) / (a + b))
