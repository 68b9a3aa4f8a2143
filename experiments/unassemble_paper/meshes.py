"""The paper's three meshes, made from their published point sets.

References
----------
Saad, "SPARSKIT: a basic tool kit for sparse matrix computations", RIACS TR90-20, 1990 (the sample meshes;
Figure 5 is number 6, refined once, Figure 6 is number 8).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

# A Delaunay triangulation of the ellipse's 24 points. It has ties (the octagon, trapezoids between the rings), which
# stand here as the source breaks them, so that no triangulation code can decide otherwise.
_ELLIPSE = [
    (0, 1, 5), (0, 1, 9), (0, 5, 6), (0, 6, 7), (0, 7, 8), (0, 8, 9), (1, 2, 4), (1, 2, 9), (1, 4, 5), (2, 3, 4),
    (2, 3, 10), (2, 9, 10), (3, 4, 12), (3, 10, 11), (3, 11, 12), (4, 5, 13), (4, 12, 13), (5, 6, 13), (6, 7, 14),
    (6, 13, 14), (7, 8, 15), (7, 14, 15), (8, 9, 17), (8, 15, 16), (8, 16, 17), (9, 10, 17), (10, 11, 18),
    (10, 17, 18), (11, 12, 20), (11, 18, 19), (11, 19, 20), (12, 13, 21), (12, 20, 21), (13, 14, 21), (14, 15, 22),
    (14, 21, 22), (15, 16, 23), (15, 22, 23),
]  # fmt: skip


@dataclass(frozen=True, eq=False)
class Mesh:
    """Points (n, 2) and counter-clockwise triangles (m, 3)."""

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]


def square(n: int = 10) -> Mesh:
    """Figure 4: n x n points, every square cut along the same diagonal. Both angles that face a diagonal are right."""
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    points = np.column_stack([j.ravel(), i.ravel()]).astype(float)
    corner = (i[:-1, :-1] * n + j[:-1, :-1]).ravel()
    lower = np.column_stack([corner, corner + 1, corner + n + 1])
    upper = np.column_stack([corner, corner + n + 1, corner + n])
    return Mesh(points, np.concatenate([lower, upper]).astype(np.int64))


def ellipse() -> Mesh:
    """Figure 5: three rings of eight points, triangulated and refined once."""
    return refined(_ellipse_coarse())


def rocket() -> Mesh:
    """Figure 6: a rectangle with a rocket-shaped hole, 330 points on 30 rays."""
    corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (0.0, 6.0)]
    rays = [_ray(i) for i in range(30)]
    points = np.array(corners + [p for ray in rays for p in ray])
    on_hole = np.zeros(len(points), dtype=bool)
    on_hole[np.cumsum([4] + [len(ray) for ray in rays])[:-1]] = True
    triangles = counter_clockwise(points, Delaunay(points).simplices)
    return Mesh(points, triangles[~on_hole[triangles].all(axis=1)])


def refined(mesh: Mesh) -> Mesh:
    """Every edge halved, every triangle cut into four similar ones."""
    t, n = mesh.triangles, len(mesh.points)
    sides = np.sort(np.stack([t[:, [1, 2]], t[:, [2, 0]], t[:, [0, 1]]], axis=1), axis=2)
    edges, place = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    a, b, c = (n + place.reshape(-1, 3)).T  # midpoints facing corners 0, 1, 2
    i, j, k = t.T
    quarters = [np.column_stack(q) for q in ((i, c, b), (c, j, a), (b, a, k), (a, b, c))]
    return Mesh(np.vstack([mesh.points, mesh.points[edges].mean(axis=1)]), np.concatenate(quarters))


def counter_clockwise(points: NDArray, triangles: NDArray) -> NDArray[np.int64]:
    """Triangles turned so that all have positive area."""
    t = np.asarray(triangles, dtype=np.int64)
    a, b, c = points[t].transpose(1, 0, 2)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return np.where((area < 0)[:, None], t[:, [0, 2, 1]], t)


def stiffness(mesh: Mesh) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Edges i < j (e, 2) in lexicographic order, and w = (cot + cot) / 2 (e,), zeros kept."""
    t, p = mesh.triangles, mesh.points
    ahead, behind = p[np.roll(t, -1, axis=1)] - p[t], p[np.roll(t, -2, axis=1)] - p[t]
    cross = ahead[..., 0] * behind[..., 1] - ahead[..., 1] * behind[..., 0]
    cotangent = (ahead * behind).sum(axis=2) / cross
    sides = np.sort(np.stack([np.roll(t, -1, axis=1), np.roll(t, -2, axis=1)], axis=2), axis=2)
    edges, place = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    return edges.astype(np.int64), np.bincount(place.ravel(), cotangent.ravel() / 2).astype(np.float64)


def _ellipse_coarse() -> Mesh:
    angle = 2 * np.pi * np.arange(1, 9) / 8
    rings = [np.column_stack([2 + 2 * i / 3 * np.cos(angle), 1.3 + 1.3 * i / 3 * np.sin(angle)]) for i in (1, 2, 3)]
    points = np.vstack(rings)
    return Mesh(points, counter_clockwise(points, np.array(_ELLIPSE)))


def _ray(i: int) -> list[tuple[float, float]]:
    """Points of one ray of the rocket, from the hole outwards."""
    theta = 2 * np.pi * i / 30
    theta = theta - 2 * np.pi if theta > np.pi else theta
    half = np.pi / 2
    r = 0.6 * (1 + 0.05 * (half**2 - theta**2) ** 2) / (1 + 0.05 * half**4)
    x, y = 4 + r * np.cos(theta), 3 + r * np.sin(theta) / 2
    points, dx, dy = [(x, y)], r * np.cos(theta) / 4, r * np.sin(theta) / 4
    while True:
        before, (x, y) = (x, y), (x + dx, y + dy)
        dx, dy = 1.1 * dx, 1.1 * dy
        if x > 6 or x < 0 or y > 6 or y < 0:
            points[-1] = _on_side(x, y, points[-1])
            return points
        if min(x, y, 6 - x, 6 - y) < 0.12:
            points.append(_near_side(x, y, before))
            return points
        points.append((x, y))


def _on_side(x: float, y: float, last: tuple[float, float]) -> tuple[float, float]:
    """The last point of a ray moved onto the side that its next step would have crossed."""
    if x > 6:
        return 6.0, last[1]
    if x < 0:
        return 0.0, last[1]
    return (last[0], 6.0) if y > 6 else (last[0], 0.0)


def _near_side(x: float, y: float, before: tuple[float, float]) -> tuple[float, float]:
    """The point on a side that stands for a step that came close to it, beside the ray's previous point."""
    if 6 - x < 0.12:
        return 6.0, before[1]
    if x < 0.12:
        return 0.0, before[1]
    return (before[0], 6.0) if 6 - y < 0.12 else (before[0], 0.0)
