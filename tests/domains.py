"""Domains that their grids do not fit: cut cells, stairs cut to diagonals, and bisection towards corners and slits."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from irregular import largest_piece
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from dense_mesh import signed_areas
from vanishing import Mesh, used

_LEAST = 0.05  # part of an edge on either side of a cut
_LEAVES = 1500  # triangles after which bisection ends

# A square about the origin in four, without the last of them, with it, or with it on the other side of a slit.
_POINTS = np.array([[-1, -1], [0, -1], [1, -1], [-1, 0], [0, 0], [1, 0], [-1, 1], [0, 1], [1, 1], [1, 0]], np.float64)
_SQUARES = [(0, 1, 4, 3), (3, 4, 7, 6), (4, 5, 8, 7)]
_LAST: list[list[tuple[int, int, int, int]]] = [[], [(1, 2, 5, 4)], [(1, 2, 9, 4)]]


def cut_cells(rng: np.random.Generator) -> Mesh:
    """Squares on one side of a line or a circle, those that it meets cut to triangles, trapezia and pentagons."""
    k = int(rng.integers(8, 24))
    centre = rng.uniform(0.3, 0.7, 2) * k
    if rng.random() < 0.5:
        side = rng.choice([-1, 1]) * (np.linalg.norm(_lattice(k, k) - centre, axis=1) - rng.uniform(0.2, 0.45) * k)
    else:
        angle = rng.uniform(0, 2 * np.pi)
        side = (_lattice(k, k) - centre) @ [np.cos(angle), np.sin(angle)]
    points, cuts, triangles = _lattice(k, k).tolist(), {}, []

    def cut(one: int, other: int) -> int:
        pair = min(one, other), max(one, other)
        if pair not in cuts:
            part = np.clip(side[pair[0]] / (side[pair[0]] - side[pair[1]]), _LEAST, 1 - _LEAST)
            cuts[pair] = len(points)
            points.append([(1 - part) * p + part * q for p, q in zip(*(points[v] for v in pair), strict=True)])
        return cuts[pair]

    for square in _squares(k, k):
        corners = []
        for one, other in zip(square, np.roll(square, -1), strict=True):
            corners += [one] if side[one] > 0 else []
            corners += [cut(one, other)] if (side[one] > 0) != (side[other] > 0) else []
        triangles += [(corners[0], *pair) for pair in pairwise(corners[1:])]
    return used(np.array(points), np.array(triangles))


def stairs(rng: np.random.Generator) -> Mesh:
    """A random domain of rectangles, with half a rectangle wherever three corners of one belong to it."""
    k, m = (int(count) for count in rng.integers(8, 22, 2))
    field = gaussian_filter(rng.standard_normal((k + 1, m + 1)), rng.uniform(0.8, 2.5))
    points, triangles = cut_to_diagonals(field > np.quantile(field, rng.uniform(0.1, 0.5)))
    points *= [rng.choice([1.0, rng.uniform(0.6, 1.6)]), 1]
    return used(points, largest_piece(triangles))


def cut_to_diagonals(inside: NDArray[np.bool_]) -> Mesh:
    """Squares of the lattice points that are inside, and half a square wherever three of its corners are.

    The points are all of the lattice, whether used or not.
    """
    k, m = inside.shape
    squares = _squares(k - 1, m - 1)
    whole, half = (squares[inside.ravel()[squares].sum(axis=1) == count] for count in (4, 3))
    triangles = np.concatenate([whole[:, :3], whole[:, [0, 2, 3]], half[inside.ravel()[half]].reshape(-1, 3)])
    return _lattice(k - 1, m - 1), triangles


def bisected(rng: np.random.Generator) -> Mesh:
    """Newest-vertex bisection towards the corner of an L, the tip of a slit, or points of a square."""
    kind = int(rng.integers(3))
    squares = np.array(_SQUARES + _LAST[kind])
    points, triangles = _POINTS, np.concatenate([squares[:, [1, 2, 0]], squares[:, [3, 0, 2]]])
    targets = rng.uniform(-1, 1, (2, 2)) if kind == 1 else np.zeros((1, 2))
    slow = rng.uniform(2, 3)
    for level in range(int(rng.integers(6, 16))):
        if len(triangles) > _LEAVES:
            break
        centre = points[triangles].mean(axis=1)
        size = np.linalg.norm(points[triangles[:, 1]] - points[triangles[:, 2]], axis=1)
        near = np.linalg.norm(centre[:, None] - targets, axis=2).min(axis=1)
        points, triangles = _divided(
            points, triangles, (near < np.maximum(1.3 * size, 0.5 * 2 ** (-level / slow))) | (level < 3)
        )
    return used(points, triangles)


def _divided(points: NDArray, triangles: NDArray, marked: NDArray) -> Mesh:
    """Bisect marked triangles, and others until no vertex lies on an edge; the first corner is the newest vertex."""
    pairs = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2)
    edges, side = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    side = side.reshape(-1, 3)
    split = np.zeros(len(edges), dtype=bool)
    split[side[marked, 0]] = True
    while not split[side[split[side].any(axis=1), 0]].all():
        split[side[split[side].any(axis=1), 0]] = True
    middle = {tuple(edges[e].tolist()): len(points) + k for k, e in enumerate(np.flatnonzero(split))}

    def parts(a: int, b: int, c: int) -> list[tuple[int, int, int]]:
        m = middle.get((min(b, c), max(b, c)))
        return [(a, b, c)] if m is None else parts(m, a, b) + parts(m, c, a)

    points = np.concatenate([points, points[edges[split]].mean(axis=1)])
    triangles = np.array([part for triangle in triangles.tolist() for part in parts(*triangle)])
    assert (signed_areas(points @ [1, 1j], triangles) > 0).all()
    return points, triangles


def _lattice(k: int, m: int) -> NDArray[np.float64]:
    return np.stack(np.meshgrid(np.arange(k + 1.0), np.arange(m + 1.0), indexing="ij"), axis=-1).reshape(-1, 2)


def _squares(k: int, m: int) -> NDArray[np.int64]:
    """(k m, 4) corners, counter-clockwise."""
    number = np.arange((k + 1) * (m + 1)).reshape(k + 1, m + 1)
    return np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
