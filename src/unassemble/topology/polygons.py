"""Many polygons in two arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .keys import runs


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
    def following_place(self) -> NDArray[np.int64]:
        """(offsets[-1],) the place in `vertices` of the vertex that follows each."""
        place = np.arange(1, len(self.vertices) + 1)
        place[self.offsets[1:] - 1] = self.offsets[:-1]
        return place

    @property
    def following(self) -> NDArray[np.int64]:
        """(offsets[-1],) the vertex that follows each."""
        return self.vertices[self.following_place]

    @property
    def cycles(self) -> list[tuple[int, ...]]:
        """Vertices of each."""
        return [tuple(cell.tolist()) for cell in np.split(self.vertices, self.offsets[1:-1])] if self.count else []

    def chosen(self, which: NDArray[np.bool_], number: NDArray) -> Polygons:
        """Some of the polygons, with vertex v called ``number[v]``."""
        size = self.size
        return Polygons(np.append(0, np.cumsum(size[which])), number[self.vertices[np.repeat(which, size)]])

    def fans(self, shift: NDArray | None = None) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
        """Triangles about one vertex of each polygon, that in place `shift`, (count,), the first one by default.

        Returns `triangles` (m, 3); `owner` (m,): the polygon of each; `outline` (m, 3): whether the side from each
        corner to the next belongs to the polygon; the others are diagonals.
        """
        owner, step = runs(self.size - 2)
        corner = np.column_stack([np.zeros_like(step), step + 1, step + 2])
        if shift is not None:
            corner = (corner + shift[owner][:, None]) % self.size[owner][:, None]
        outline = np.column_stack([step == 0, np.ones(len(step), bool), step + 3 == self.size[owner]])
        return self.vertices[self.offsets[owner][:, None] + corner], owner, outline

    def counter_clockwise(self, points: NDArray) -> Polygons:
        """The same polygons, each in the order in which its area is positive.

        `points` (n, 2).
        """
        owner, following = np.repeat(np.arange(self.count), self.size), self.following_place
        x, y = (points[self.vertices] - points[self.vertices[self.offsets[owner]]]).T
        area = np.bincount(owner, x * y[following] - y * x[following], self.count)
        place = np.arange(len(owner))
        backwards = self.offsets[owner] + self.offsets[owner + 1] - 1 - place
        return Polygons(self.offsets, self.vertices[np.where(area[owner] < 0, backwards, place)])
