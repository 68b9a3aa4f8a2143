"""A graph drawn on the sphere: half-edges that close to faces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .keys import contains, distinct, first_rows, pair_keys, runs
from .numbering import connected
from .orientation import glue, loops, orient


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
        successor[visit] = self.successor[visit[_cyclic_neighbour(key, -1)]]
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
        successor[at] = self.successor[at[_cyclic_neighbour(self.head[at], 1)]]
        return FaceComplex(self.n_vertices, self.edges, successor)


def from_rotation(n: int, edges: NDArray, tail: NDArray, head: NDArray) -> FaceComplex:
    """The complex of a planar embedding.

    `edges` (e, 2); `tail` and `head` (2 e,): half-edges grouped by tail, each group in cyclic order.
    """
    half = half_edges(n, edges, tail, head)
    successor = np.empty(2 * len(edges), dtype=np.int64)
    # From a -> b to b -> c, where c follows a in the rotation about b.
    successor[half ^ 1] = half[_cyclic_neighbour(tail, 1)]
    return FaceComplex(n, edges, successor)


def from_cycles(n: int, edges: NDArray, triangles: NDArray, quads: NDArray) -> FaceComplex | None:
    """The complex whose faces are given cycles and the loops that bound the surface they make.

    `edges` (e, 2); `triangles` (m, 3) and `quads` (k, 4): in any orientation.

    Trees that hang on the surface are blocks of their own. None if any other edge lies on no cycle, or one on
    more than two, or the surfaces do not lie on spheres.
    """
    sides = [around(n, edges, cycles) for cycles in _oriented(n, edges, triangles, quads)]
    used = np.bincount(np.concatenate([s.ravel() for s in sides]), minlength=2 * len(edges))
    bare = np.flatnonzero(~used.reshape(-1, 2).any(axis=1))
    hanging = np.zeros(len(edges), dtype=bool)
    for _ in range(20):  # rounds of plucking leaves
        degree = np.bincount(edges[~hanging].ravel(), minlength=n)
        leaf = ~hanging & (degree[edges] == 1).any(axis=1)
        if not leaf.any():
            break
        hanging |= leaf
    if (used > 1).any() or not hanging[bare].all():
        return None
    successor = np.full(2 * len(edges), -1, dtype=np.int64)
    for side in sides:
        successor[side] = np.roll(side, -1, axis=1)
    successor[2 * bare], successor[2 * bare + 1] = 2 * bare + 1, 2 * bare
    complex_ = FaceComplex(n, edges, _with_boundary(successor))
    return complex_ if complex_.is_sphere() else None


def half_edges(n: int, edges: NDArray, tail: NDArray, head: NDArray) -> NDArray[np.int64]:
    """Half-edges from `tail` to `head`, which are joined by an edge."""
    return 2 * np.searchsorted(edges[:, 0] * n + edges[:, 1], pair_keys(n, tail, head)) + (tail > head)


def around(n: int, edges: NDArray, cycles: NDArray) -> NDArray[np.int64]:
    """(m, k) half-edges along cycles (m, k), from each vertex to the next."""
    return half_edges(n, edges, cycles.ravel(), np.roll(cycles, -1, axis=1).ravel()).reshape(cycles.shape)


def joined(n: int, edges: NDArray, a: NDArray, b: NDArray) -> NDArray[np.bool_]:
    """Whether vertices a and b are joined by an edge, pair by pair."""
    return contains(edges[:, 0] * n + edges[:, 1], pair_keys(n, a, b))


def _oriented(n: int, edges: NDArray, triangles: NDArray, quads: NDArray) -> tuple[NDArray, NDArray]:
    """Turn cycles so that neighbours run along common edges in opposite directions, as far as that is possible."""
    m, k = len(triangles), len(quads)
    halves = np.concatenate([triangles, quads[:, :3], quads[:, [0, 2, 3]]])
    if not len(halves):
        return triangles, quads
    facing = np.roll(around(n, edges, halves) >> 1, -1, axis=1)
    facing[m : m + k, 1] = facing[m + k :, 2] = len(edges) + np.arange(k)  # diagonals
    flip = orient(halves, glue(len(edges) + k, facing))[0][: m + k, None]
    return np.where(flip[:m], triangles[:, ::-1], triangles), np.where(flip[m:], quads[:, ::-1], quads)


def _with_boundary(successor: NDArray) -> NDArray[np.int64]:
    """Close the free half-edges, those without a successor, to loops, turning about their heads."""
    successor = successor.copy()
    predecessor = np.full_like(successor, -1)
    inner = np.flatnonzero(successor >= 0)
    predecessor[successor[inner]] = inner
    free = np.flatnonzero(successor < 0)
    current = free ^ 1
    turning = np.arange(len(free))
    while len(turning):
        current[turning] = predecessor[current[turning]] ^ 1
        turning = turning[predecessor[current[turning]] >= 0]
    successor[free] = current
    return successor


def _cyclic_neighbour(key: NDArray, step: int) -> NDArray[np.int64]:
    """Places of the cyclic neighbours within runs of equal keys."""
    count = np.diff(np.append(np.flatnonzero(np.diff(key, prepend=-1)), len(key)))
    run, place = runs(count)
    return np.arange(len(key)) - place + (place + step) % count[run]
