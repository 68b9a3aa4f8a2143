"""Triangles and undivided cells glued on the boundary of a mesh one by one, many of them with vanished sides."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dense_mesh import Mesh
from meshes import delaunay
from vanishing import Mesh as Arrays

_CLEAR = 1e-3  # of the length of an edge that new triangles keep from others


def glued(rng: np.random.Generator) -> Arrays:
    """Delaunay triangles of random points with up to 13 right triangles, caps, half circles and others glued on."""
    points, triangles = delaunay(rng.random((int(rng.integers(6, 60)), 2)))
    z, t = points @ [1, 1j], triangles
    for _ in range(int(rng.integers(1, 14))):
        edges = Mesh(z, t).boundary
        b, a = edges[rng.integers(len(edges))]  # the free side of a-b is on the left
        new = _outline(rng, z[a], z[b])
        ring = np.r_[a, b, len(z) + np.arange(len(new))]
        after = np.append(z, new)
        fan = np.column_stack([np.full(len(new), a), ring[1:-1], ring[2:]])
        if _is_free(after, t, fan, edges):
            z, t = after, np.concatenate([t, fan])
    return np.column_stack([z.real, z.imag]), t


def _outline(rng: np.random.Generator, a: complex, b: complex) -> NDArray[np.complex128]:
    """Further vertices, counter-clockwise from b on, of a convex cell on the left of a-b."""
    kind = rng.choice(["right", "opposite", "any", "cap", "half"])
    along = b - a
    if kind == "right":  # at a or at b
        return np.array([(a if rng.random() < 0.5 else b) + 1j * along * rng.uniform(0.3, 1.6)])
    if kind == "opposite":  # on the circle over a-b
        return np.array([(a + b) / 2 + along / 2 * np.exp(1j * rng.uniform(0.3, np.pi - 0.3))])
    if kind == "any":
        return np.array([a + along * complex(rng.uniform(0.1, 0.9), rng.uniform(0.3, 1.2))])
    # On a circle that a-b is seen from under an angle; the last new vertex is opposite b on half circles.
    angle = rng.uniform(0.3, 1.0) if kind == "half" else rng.uniform(0.6, 2.2)
    centre = (a + b) / 2 + 0.5j * along / np.tan(angle)
    full = np.pi if kind == "half" else 2 * (np.pi - angle)
    count = int(rng.integers(2, 4))
    places = np.cumsum(rng.uniform(0.5, 1.5, count + (kind == "cap")))
    return centre + (b - centre) * np.exp(1j * full * places[:count] / places[-1])


def _is_free(z: NDArray, triangles: NDArray, fan: NDArray, boundary: NDArray) -> bool:
    """Whether new triangles are round enough, and neither touch nor cover what was there."""
    corners = z[fan]
    area = np.imag(np.conj(corners[:, 1] - corners[:, 0]) * (corners[:, 2] - corners[:, 0]))
    longest = np.abs(corners - np.roll(corners, 1, axis=1)).max(axis=1)
    if (area < 0.02 * longest**2).any():
        return False
    old, new = np.setdiff1d(triangles, fan), np.setdiff1d(fan, triangles)
    inside = [_inside(z[triangles], z[new]).any(), _inside(corners, z[old]).any()]
    ring = np.r_[fan[0, :2], fan[:, 2], fan[0, 0]]
    sides = np.column_stack([ring[1:-1], ring[2:]])
    return not (any(inside) or _crossing(z[sides][:, None], z[boundary][None]).any())


def _side(p: NDArray, q: NDArray, r: NDArray) -> NDArray[np.float64]:
    """Twice the area of p-q-r over |q - p|^2: positive if r lies on the left of p-q."""
    return np.imag(np.conj(q - p) * (r - p)) / np.abs(q - p) ** 2


def _inside(corners: NDArray, at: NDArray) -> NDArray[np.bool_]:
    """(triangles, points) in or next to triangles (m, 3)."""
    p = corners[:, :, None]
    return (_side(p, np.roll(p, -1, axis=1), at[None, None]) > -_CLEAR).all(axis=1)


def _crossing(one: NDArray, other: NDArray) -> NDArray[np.bool_]:
    """Whether segments (..., 2) cross, common ends aside."""
    (p, q), (r, s) = np.moveaxis(one, -1, 0), np.moveaxis(other, -1, 0)
    apart = (p != r) & (p != s) & (q != r) & (q != s)
    return apart & (_side(p, q, r) * _side(p, q, s) < _CLEAR**2) & (_side(r, s, p) * _side(r, s, q) < _CLEAR**2)
