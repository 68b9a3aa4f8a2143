"""Graphs drawn on the sphere by the order of edges about each vertex, or by some of their faces."""

import numpy as np
from numpy.typing import NDArray

from .faces import FaceComplex, around, cyclic_neighbour, half_edges
from .orientation import glue, orient


def from_rotation(n: int, edges: NDArray, tail: NDArray, head: NDArray) -> FaceComplex:
    """The complex of a planar embedding.

    `edges` (e, 2); `tail` and `head` (2 e,): half-edges grouped by tail, each group in cyclic order.
    """
    half = half_edges(n, edges, tail, head)
    successor = np.empty(2 * len(edges), dtype=np.int64)
    # From a -> b to b -> c, where c follows a in the rotation about b.
    successor[half ^ 1] = half[cyclic_neighbour(tail, 1)]
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
