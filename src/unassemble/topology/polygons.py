"""Many polygons in two arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Polygons:
    """Cycles of vertices."""

    offsets: NDArray[np.int64]  # (count + 1,)
    vertices: NDArray[np.int64]  # (offsets[-1],) polygon k is ``vertices[offsets[k]:offsets[k + 1]]``, in running order

    @classmethod
    def none(cls) -> Polygons:
        """No polygons."""
        return cls(np.zeros(1, np.int64), np.empty(0, np.int64))

    @classmethod
    def of_triangles(cls, triangles: NDArray[np.int64]) -> Polygons:
        """Triangles (m, 3)."""
        return cls(3 * np.arange(len(triangles) + 1), triangles.ravel())

    @classmethod
    def of(cls, cycles: Sequence[Sequence[int]]) -> Polygons:
        """Cycles one by one."""
        offsets = np.append(0, np.cumsum([len(cycle) for cycle in cycles], dtype=np.int64))
        return cls(offsets, np.array([v for cycle in cycles for v in cycle], dtype=np.int64))

    @classmethod
    def joined(cls, parts: list[Polygons]) -> Polygons:
        """The polygons of all parts."""
        size = np.concatenate([np.empty(0, np.int64), *(part.size for part in parts)])
        vertices = np.concatenate([np.empty(0, np.int64), *(part.vertices for part in parts)])
        return cls(np.append(0, np.cumsum(size)), vertices)

    @property
    def count(self) -> int:
        """Number of polygons."""
        return len(self.offsets) - 1

    @property
    def size(self) -> NDArray[np.int64]:
        """(count,) number of vertices of each."""
        return np.diff(self.offsets)

    @property
    def following(self) -> NDArray[np.int64]:
        """(offsets[-1],) the vertex that follows each."""
        place = np.arange(1, len(self.vertices) + 1)
        place[self.offsets[1:] - 1] = self.offsets[:-1]
        return self.vertices[place]

    def chosen(self, which: NDArray[np.bool_], number: NDArray) -> Polygons:
        """Some of the polygons, with vertex v called ``number[v]``."""
        size = self.size
        return Polygons(np.append(0, np.cumsum(size[which])), number[self.vertices[np.repeat(which, size)]])

    def fans(self) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Triangles about the first vertex of each polygon.

        Returns `triangles` (m, 3); `outline` (m, 3): whether the side from each corner to the next belongs to the
        polygon; the others are diagonals.
        """
        size = self.size - 2
        owner = np.repeat(np.arange(self.count), size)
        step = np.arange(len(owner)) - np.repeat(np.cumsum(size) - size, size) + 1
        start = self.offsets[owner]
        triangles = np.column_stack(
            [self.vertices[start], self.vertices[start + step], self.vertices[start + step + 1]]
        )
        return triangles, np.column_stack([step == 1, np.ones(len(step), bool), step == size[owner]])

    def counter_clockwise(self, points: NDArray) -> Polygons:
        """The same polygons, each in the order in which its area is positive.

        `points` (n, 2).
        """
        size = self.size
        owner = np.repeat(np.arange(self.count), size)
        place = np.arange(len(self.vertices)) - self.offsets[owner]
        following = self.offsets[owner] + (place + 1) % size[owner]
        x, y = (points[self.vertices] - points[self.vertices[self.offsets[owner]]]).T
        area = np.bincount(owner, x * y[following] - y * x[following], self.count)
        backwards = self.offsets[owner] + size[owner] - 1 - place
        return Polygons(self.offsets, self.vertices[np.where(area[owner] < 0, backwards, np.arange(len(owner)))])
