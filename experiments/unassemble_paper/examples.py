"""Small meshes and angle sequences that settle questions the paper leaves open."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from .meshes import Mesh, counter_clockwise


def wheel(radii: NDArray) -> Mesh:
    """A hub and a rim point at each radius (k,), k >= 4, at equal angles about the hub.

    Every angle that faces a boundary edge is 2 pi / k whatever the radii: the boundary entries (2) of the matrix are
    the same for all of them. This is Figure 2's point.
    """
    k = len(radii)
    rim = np.asarray(radii) * np.exp(2j * np.pi * np.arange(k) / k)
    return wheel_of(np.column_stack([rim.real, rim.imag]))


def wheel_of(rim: NDArray) -> Mesh:
    """A hub at the origin and rim points (k, 2) counter-clockwise about it."""
    k, i = len(rim), np.arange(len(rim))
    return Mesh(np.vstack([[0.0, 0.0], rim]), np.column_stack([np.zeros(k, np.int64), 1 + i, 1 + (i + 1) % k]))


def spiral_angles(k: int, twist: float) -> NDArray[np.float64]:
    """(k, 3) angles of a wheel of k triangles that satisfy conditions 1 and 2 of a valid sequence, and not 3.

    At the hub 2 pi / k, on the rim the two base angles plus and minus `twist`: the sums are right, but going once
    around the hub the spokes grow by (sin(base + twist) / sin(base - twist))^k.
    """
    hub = 2 * np.pi / k
    base = (np.pi - hub) / 2
    return np.tile([hub, base + twist, base - twist], (k, 1))


def perforated(side: int, holes: int, *, seed: int = 0) -> Mesh:
    """A jittered grid of side x side points with up to four holes around grid points; `side` at least 12 for four."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2).astype(float)
    inside = ((grid > 0) & (grid < side - 1)).all(axis=1)
    grid[inside] += 0.2 * rng.uniform(-1, 1, (int(inside.sum()), 2))
    triangles = counter_clockwise(grid, Delaunay(grid).simplices)
    a, b, c = grid[triangles].transpose(1, 0, 2)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    centre = (a + b + c) / 3
    kept = area > 1e-6
    for x, y in ((3, 3), (side - 4, side - 4), (3, side - 4), (side - 4, 3))[:holes]:
        kept &= np.hypot(centre[:, 0] - x, centre[:, 1] - y) > 1.3
    used, local = np.unique(triangles[kept], return_inverse=True)
    return Mesh(grid[used], local.reshape(-1, 3).astype(np.int64))


def ragged(side: int, *, seed: int = 0) -> Mesh:
    """A lattice with all points shaken by up to 0.3: thin triangles along the boundary, up to sides of 2.6."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2)
    points = grid + rng.uniform(-0.3, 0.3, grid.shape)
    triangles = counter_clockwise(points, Delaunay(points).simplices)
    sides = np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, axis=1)], axis=2)
    return Mesh(points, triangles[(sides <= 2.6).all(axis=1)])


def hexagon(radius: int) -> Mesh:
    """The vertices of the triangular lattice at most `radius` steps from the origin."""
    i, j = np.meshgrid(np.arange(-radius, radius + 1), np.arange(-radius, radius + 1))
    inside = np.abs(i + j) <= radius
    points = np.column_stack([(i + j / 2)[inside], (np.sqrt(3) / 2 * j)[inside]])
    return Mesh(points, counter_clockwise(points, Delaunay(points).simplices))


def two_hexagonal_holes() -> Mesh:
    """A hexagon of the triangular lattice without two of its inner vertices: tri-connected, and h = 2."""
    mesh = hexagon(4)
    p = mesh.points
    gone = np.flatnonzero(np.hypot(np.abs(p[:, 0]) - 2, p[:, 1]) < 0.5)
    used, local = np.unique(mesh.triangles[~np.isin(mesh.triangles, gone).any(axis=1)], return_inverse=True)
    return Mesh(p[used], local.reshape(-1, 3).astype(np.int64))
