"""A graph drawn on the sphere: half-edges that close to faces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .keys import contains, distinct, first_rows, pair_keys, runs
from .numbering import connected
from .orientation import loops


@dataclass(frozen=True, eq=False)
class FaceComplex:
    """A graph and, for each side of each edge, the side that follows it along a face.

    Half-edge 2 k runs along edge k from its lower to its higher vertex, 2 k + 1 back: ``h ^ 1`` is the other side.
    """

    n_vertices: int
    edges: NDArray[np.int64]  # (e, 2) pairs i < j in lexicographic order
    successor: NDArray[np.int64]  # (2 e,) the next half-edge of the face on the left

    @property
    def tail(self) -> NDArray[np.int64]:
        """(2 e,) vertex at which each half-edge starts."""
        return self.edges.ravel()

    @cached_property
    def head(self) -> NDArray[np.int64]:
        """(2 e,) vertex at which each half-edge ends."""
        return self.edges[:, ::-1].ravel()

    @cached_property
    def _loops(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        return loops(self.successor)

    @property
    def face(self) -> NDArray[np.int64]:
        """(2 e,) face on the left of each half-edge."""
        return self._loops[0]

    @property
    def order(self) -> NDArray[np.int64]:
        """(2 e,) half-edges face by face, in running order."""
        return self._loops[1]

    @cached_property
    def size(self) -> NDArray[np.int64]:
        """(faces,) number of edges of each face."""
        return np.bincount(self.face)

    @cached_property
    def offsets(self) -> NDArray[np.int64]:
        """(faces + 1,) face k is ``order[offsets[k]:offsets[k + 1]]``."""
        return np.append(0, np.cumsum(self.size))

    @cached_property
    def simple(self) -> NDArray[np.bool_]:
        """(faces,) whether a face is a cycle of three or more different vertices."""
        visited = distinct(self.face * self.n_vertices + self.tail) // self.n_vertices
        return (np.bincount(visited, minlength=len(self.size)) == self.size) & (self.size >= 3)

    @cached_property
    def block(self) -> NDArray[np.int64]:
        """(2 e,) label of the part that hangs together by edges and faces."""
        m = len(self.successor)
        rows = np.arange(m)
        return connected(m, np.r_[rows, rows], np.r_[rows ^ 1, self.successor])[1]

    def is_sphere(self) -> bool:
        """Euler's formula v - e + f = 2 for every block, a vertex counted once for each of its turns."""
        turn, _ = loops(self.successor[np.arange(len(self.successor)) ^ 1])
        counts = [np.bincount(self.block[first_rows(label, int(label.max()) + 1)]) for label in (turn, self.face)]
        edges = np.bincount(self.block[::2])
        return bool((counts[0] - edges + counts[1] == 2).all())

    def split(self) -> FaceComplex:
        """The same graph block by block: faces that pass a vertex more than once are cut there."""
        rank = np.empty(len(self.order), dtype=np.int64)
        rank[self.order] = np.arange(len(rank))
        visit = np.lexsort((rank, self.face * self.n_vertices + self.head))
        key = (self.face * self.n_vertices + self.head)[visit]
        successor = self.successor.copy()
        # Of several visits each continues as the one before it would: what lies between closes to a face.
        successor[visit] = self.successor[visit[cyclic_neighbour(key, -1)]]
        return FaceComplex(self.n_vertices, self.edges, successor)

    def joined(self, empty: NDArray[np.bool_]) -> FaceComplex:
        """Blocks hung into each other's empty faces: at each vertex one such face of each block becomes one face.

        `empty` (faces,).
        """
        at = np.flatnonzero(empty[self.face])
        # One visit for each block and vertex, that of the longest face.
        at = at[np.lexsort((-self.size[self.face[at]], self.block[at], self.head[at]))]
        key = self.head[at] * (int(self.block.max()) + 1) + self.block[at]
        at = at[np.flatnonzero(np.diff(key, prepend=-1))]
        successor = self.successor.copy()
        successor[at] = self.successor[at[cyclic_neighbour(self.head[at], 1)]]
        return FaceComplex(self.n_vertices, self.edges, successor)


def half_edges(n: int, edges: NDArray, tail: NDArray, head: NDArray) -> NDArray[np.int64]:
    """Half-edges from `tail` to `head`, which are joined by an edge."""
    return 2 * np.searchsorted(edges[:, 0] * n + edges[:, 1], pair_keys(n, tail, head)) + (tail > head)


def around(n: int, edges: NDArray, cycles: NDArray) -> NDArray[np.int64]:
    """(m, k) half-edges along cycles (m, k), from each vertex to the next."""
    return half_edges(n, edges, cycles.ravel(), np.roll(cycles, -1, axis=1).ravel()).reshape(cycles.shape)


def joined(n: int, edges: NDArray, a: NDArray, b: NDArray) -> NDArray[np.bool_]:
    """Whether vertices a and b are joined by an edge, pair by pair."""
    return contains(edges[:, 0] * n + edges[:, 1], pair_keys(n, a, b))


def cyclic_neighbour(key: NDArray, step: int) -> NDArray[np.int64]:
    """Places of the cyclic neighbours within runs of equal keys."""
    count = np.diff(np.append(np.flatnonzero(np.diff(key, prepend=-1)), len(key)))
    run, place = runs(count)
    return np.arange(len(key)) - place + (place + step) % count[run]
