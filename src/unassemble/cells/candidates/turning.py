"""Parts of a graph that can be turned over, and the corners that this joins anew.

Where the outside, or a hole, or one of each, pass a vertex u twice, as a1-u-b1 and a2-u-b2, the graph falls apart at
u, or at u and another such vertex. Turned over, one part takes its corners at u from a1-u-b1 and a2-u-b2 to a1-u-a2
and b1-u-b2. A drawing does not tell how its parts lie to each other; only right angles that join parts depend on it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

_MOST_MOVES = 200


@dataclass(frozen=True, eq=False)
class Turns:
    """Vertices that empty faces pass twice.

    Attributes
    ----------
    drawn, crossed : (k, 2) int64
        Corners a1-u-b1 and a2-u-b2, and those with one part turned over, a1-u-a2 and b1-u-b2; -1 for none.
    faces : (k, 2) int64
        Those that pass, in increasing order.
    rank : (k,) int64
        Place of u along the first of them.
    far : (k, 2, 2) int64
        Vertices a1, b1 and a2, b2.
    pivoted : (k,) bool
        Whether the same two faces pass a vertex where nothing changes when a part is turned over.
    """

    drawn: NDArray[np.int64]
    crossed: NDArray[np.int64]
    faces: NDArray[np.int64]
    rank: NDArray[np.int64]
    far: NDArray[np.int64]
    pivoted: NDArray[np.bool_]

    def turned(self, labels: NDArray[np.bool_]) -> Iterator[NDArray[np.bool_]]:
        """Labels with one part turned over, where that changes them.

        Parameters
        ----------
        labels : (corners,) bool
        """
        for vertices in islice(self._moves(), _MOST_MOVES):
            one, other = self.drawn[vertices].ravel(), self.crossed[vertices].ravel()
            in_one, in_other = (labels[corners] & (corners >= 0) for corners in (one, other))
            if (in_one | in_other).any() and not (in_one & (other < 0) | in_other & (one < 0)).any():
                changed = labels.copy()
                changed[one[one >= 0]] = in_other[one >= 0]
                changed[other[other >= 0]] = in_one[other >= 0]
                yield changed

    def _moves(self) -> Iterator[NDArray[np.int64]]:
        """Vertices, one or two, at which a part is cut off and can be turned over; small parts first."""
        for vertices in self._rings():
            k = len(vertices)
            if k and self.faces[vertices[0], 0] == self.faces[vertices[0], 1]:
                yield from vertices[:, None]
                continue
            yield from vertices[self.pivoted[vertices]][:, None]
            for step in range(1, k // 2 + 1):
                for i in range(k if 2 * step < k else k // 2):
                    one, other = vertices[i], vertices[(i + step) % k]
                    if step > 1 or not self._symmetric(one, other):
                        yield np.array([one, other])

    def _rings(self) -> list[NDArray[np.int64]]:
        """Vertices with the same two faces, in order along them."""
        order = np.lexsort((self.rank, self.faces[:, 1], self.faces[:, 0]))
        new = (np.diff(self.faces[order], axis=0) != 0).any(axis=1)
        return np.split(order, np.flatnonzero(new) + 1)

    def _symmetric(self, one: int, other: int) -> bool:
        """Whether all that lies between is two vertices joined to both."""
        return {self.far[one, 0, 1], self.far[one, 1, 0]} == {self.far[other, 0, 0], self.far[other, 1, 1]}
