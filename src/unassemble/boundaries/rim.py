"""Which entries a fit can rely on, from the rim inwards.

A vertex at the rim has two coordinates and few whole entries: those on its edges, and on the edges that face it. Where
there are no more than unknowns, of one vertex or a few in a row, entries may determine them, but then in several ways,
and a fit easily takes the wrong one, which bends the rest. Such vertices are taken off, and their triangles with them;
and where a fit ends with a misfit all the same, the vertices of the rim next to it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece
from .patch import nearest, spread


@dataclass(frozen=True, eq=False)
class Rim:
    """Triangles that are left (m,) bool, and entries (e,) that are whole where both triangles of an edge are left."""

    piece: Piece
    given: NDArray[np.bool_]
    left: NDArray[np.bool_]

    @classmethod
    def of(cls, piece: Piece, given: NDArray[np.bool_]) -> Rim:
        """All triangles, but for those of vertices with too few entries."""
        return cls(piece, given, np.ones(len(piece.triangles), dtype=bool)).pruned()

    @cached_property
    def _sides(self) -> NDArray[np.int64]:
        """(e,) number of triangles left on each edge."""
        return np.bincount(self.piece.opposite[self.left].ravel(), minlength=len(self.piece.edges))

    @cached_property
    def whole(self) -> NDArray[np.bool_]:
        """(e,) entries that the triangles left have whole."""
        return np.asarray(self.given & (self._sides == self.piece.inner + 1))

    @cached_property
    def _open(self) -> NDArray[np.bool_]:
        """(e,) edges of triangles that are left, without a whole entry."""
        return np.asarray((self._sides > 0) & ~self.whole)

    def pruned(self) -> Rim:
        """Without vertices, alone or in rows along the rim, that have no more entries than coordinates."""
        rim = self
        while len(gone := list(rim._loose())):
            left = rim.left & ~_marked(rim.piece, gone)[rim.piece.triangles].any(axis=1)
            rim = Rim(rim.piece, rim.given, left)
        return rim

    def _loose(self) -> Iterator[int]:
        piece, whole, opened = self.piece, self.whole, self._open
        near = self.left & self.opened[piece.triangles].any(axis=1)
        entries: dict[int, set[int]] = {v: set() for v in np.flatnonzero(self.opened).tolist()}
        for corners, sides in zip(piece.triangles[near].tolist(), piece.opposite[near].tolist(), strict=True):
            own = [side for side in sides if whole[side]]
            for v in corners:
                if v in entries:
                    entries[v].update(own)
        along: dict[int, list[int]] = {v: [] for v in entries}
        for a, b in piece.edges[opened].tolist():
            along[a].append(b)
            along[b].append(a)
        gone: set[int] = set()
        for v in entries:
            for row in _rows(v, along):
                if gone & set(row):
                    continue
                if len(set().union(*(entries[w] for w in row))) <= 2 * len(row):
                    gone.update(row)
                    yield from row
                    break

    @cached_property
    def opened(self) -> NDArray[np.bool_]:
        """(n,) vertices of edges without a whole entry."""
        return _marked(self.piece, self.piece.edges[self._open])

    @property
    def inside(self) -> NDArray[np.bool_]:
        """(n,) vertices of triangles that are left."""
        return _marked(self.piece, self.piece.triangles[self.left])

    def bared(self) -> Rim:
        """Without all vertices of the rim."""
        left = self.left & ~self.opened[self.piece.triangles].any(axis=1)
        return Rim(self.piece, self.given, left).pruned()

    def peeled(self, misfit: NDArray, least: float, keep: NDArray[np.bool_] | None = None) -> Rim | None:
        """Without the vertices of the rim that are nearest to peaks of misfits (e,); None where there are none.

        Triangles marked in `keep`, (m,) bool, stay. Peaks are larger than `least`, and than all others near.
        """
        piece, opened, reach = self.piece, self.opened, 6
        rest = np.where(self.whole, misfit, 0.0)
        hot = np.zeros(piece.n_vertices)
        for end in piece.edges.T:
            np.maximum.at(hot, end, rest)
        peak = (hot == spread(piece, hot, np.maximum, 4)) & (hot > least) & (hot > 0)
        far, label = nearest(piece, np.where(peak, np.arange(piece.n_vertices), -1), reach)
        reached = np.flatnonzero(opened & (label >= 0))
        first = np.full(piece.n_vertices, reach + 1)
        np.minimum.at(first, label[reached], far[reached])
        gone = np.zeros(piece.n_vertices, dtype=bool)
        gone[reached] = far[reached] <= first[label[reached]]
        left = self.left & (~gone[piece.triangles].any(axis=1) | (False if keep is None else keep))
        return Rim(piece, self.given, left) if (left != self.left).any() else None


def _marked(piece: Piece, vertices: NDArray | list[int]) -> NDArray[np.bool_]:
    """(n,) whether a vertex is among some."""
    marked = np.zeros(piece.n_vertices, dtype=bool)
    marked[vertices] = True
    return marked


def _rows(v: int, along: dict[int, list[int]]) -> Iterator[list[int]]:
    """A vertex, and rows of up to four along the rim that begin with it."""
    yield [v]
    for second in along[v]:
        row = [v, second]
        while True:
            yield row
            onward = [w for w in along[row[-1]] if w not in row]
            if len(row) == 4 or len(onward) != 1:
                break
            row = [*row, onward[0]]
