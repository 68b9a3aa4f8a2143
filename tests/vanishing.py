"""Meshes whose matrices have zero entries, and matrices that do not store them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from skfem import MeshTri

from meshes import Specimen, random_mesh

Mesh = tuple[NDArray, NDArray]


def without_zeros(matrix: sp.csr_array, tolerance: float = 1e-12) -> sp.csr_array:
    """The matrix without off-diagonal entries of at most `tolerance` times the largest of both of their rows."""
    entries = matrix.tocoo()
    off = entries.row != entries.col
    size = np.zeros(matrix.shape[0])
    np.maximum.at(size, entries.row[off], np.abs(entries.data[off]))
    small = np.abs(entries.data) <= tolerance * np.minimum(size[entries.row], size[entries.col])
    keep = ~(off & small)
    return sp.coo_array((entries.data[keep], (entries.row[keep], entries.col[keep])), shape=matrix.shape).tocsr()


def squares(mask: NDArray, *, width: float = 1.0, crossed: bool = False) -> Mesh:
    """A grid of rectangles, those where `mask` (k, l) is true, in two triangles each, or in four about the centre."""
    k, m = mask.shape
    x, y = np.meshgrid(np.arange(k + 1), np.arange(m + 1), indexing="ij")
    points = np.column_stack([width * x.ravel(), y.ravel()])
    number = np.arange(len(points)).reshape(x.shape)
    a, b, c, d = (corner[mask] for corner in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    if not crossed:
        return used(points, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]))
    centre = len(points) + np.arange(len(a))
    points = np.concatenate([points, (points[a] + points[c]) / 2])
    sides = ((a, b), (b, c), (c, d), (d, a))
    return used(points, np.concatenate([np.column_stack([p, q, centre]) for p, q in sides]))


def holes(k: int, m: int, *rectangles: tuple[int, int, int, int]) -> NDArray[np.bool_]:
    """(k, m) true but for rectangles (i, j, width, height)."""
    mask = np.ones((k, m), dtype=bool)
    for i, j, width, height in rectangles:
        mask[i : i + width, j : j + height] = False
    return mask


def polar(rings: int, sectors: int, inner: float, *, whole: bool = True) -> Mesh:
    """An annulus, or half of one, of trapezia with all corners on a circle."""
    radius = np.linspace(inner, 2, rings + 1)
    angle = np.linspace(0, 2 * np.pi if whole else np.pi, sectors + 1)[: sectors if whole else None]
    points = (radius[:, None] * np.exp(1j * angle)).ravel().view(np.float64).reshape(-1, 2)
    number = np.arange(len(points)).reshape(rings + 1, -1)
    if whole:
        number = np.column_stack([number, number[:, 0]])
    a, b, c, d = (q.ravel() for q in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return points, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def octagons(mask: NDArray, *, squares: bool = True) -> Mesh:
    """Regular octagons, those of a grid where `mask` (k, m) is true, and the squares between four of them, or not."""
    cut, width = np.sqrt(0.5), 1 + np.sqrt(2)
    x = np.array([0, 1, 1 + cut, 1 + cut, 1, 0, -cut, -cut])
    octagon, diamond = x + 1j * np.roll(x, 2), cut * (np.array([-1, -1j, 1, 1j]) - 1 - 1j)
    place = width * (np.arange(mask.shape[0])[:, None] + 1j * np.arange(mask.shape[1]))
    cells = [octagon + z for z in place[mask]]
    if squares:
        four = mask[:-1, :-1] & mask[1:, :-1] & mask[:-1, 1:] & mask[1:, 1:]
        cells += [diamond + z for z in place[1:, 1:][four]]
    corners = np.concatenate(cells)
    _, first, number = np.unique(np.round(corners, 6), return_index=True, return_inverse=True)
    own = np.split(number, np.cumsum([len(cell) for cell in cells])[:-1])
    triangles = [(cell[0], *pair) for cell in own for pair in pairwise(cell[1:])]
    return corners[first].view(np.float64).reshape(-1, 2), np.array(triangles)


def refined(rounds: int, seed: int) -> Mesh:
    """Right triangles, refined around random points by scikit-fem."""
    rng = np.random.default_rng(seed)
    mesh = MeshTri.init_tensor(np.linspace(0, 1, 4), np.linspace(0, 1, 4))
    for _ in range(rounds):
        centre = mesh.p[:, mesh.t].mean(axis=1)
        mesh = mesh.refined(np.flatnonzero(np.linalg.norm(centre - rng.random((2, 1)), axis=0) < 0.3))
    return mesh.p.T.copy(), mesh.t.T.astype(np.int64)


def half_jittered(k: int, seed: int = 0) -> Mesh:
    """Squares on the right, arbitrary triangles on the left."""
    points, triangles = squares(np.ones((k, k), bool))
    left = points[:, 0] < k / 2 - 0.5
    points[left] += np.random.default_rng(seed).uniform(-0.2, 0.2, (left.sum(), 2))
    return points, triangles


def triangular_holes(n: int, count: int, seed: int = 0) -> Mesh:
    """A random mesh without `count` inner triangles that share no vertex."""
    points, triangles = random_mesh(n, seed, holes=False)
    edges, times = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2), axis=0,
                             return_counts=True)  # fmt: skip
    taken = np.zeros(len(points), dtype=bool)
    taken[edges[times == 1]] = True
    keep = np.ones(len(triangles), dtype=bool)
    for k in np.random.default_rng(seed).permutation(len(triangles)):
        if count and not taken[triangles[k]].any():
            taken[triangles[k]] = True
            keep[k] = False
            count -= 1
    return points, triangles[keep]


def used(points: NDArray, triangles: NDArray) -> Mesh:
    """Without points of no triangle."""
    rows, triangles = np.unique(triangles, return_inverse=True)
    return points[rows], triangles.reshape(-1, 3)


def area(points: NDArray, triangles: NDArray) -> float:
    """Sum of the areas."""
    a, b, c = (points @ [1, 1j])[triangles].T
    return float(np.abs((np.conj(b - a) * (c - a)).imag).sum() / 2)


def forgotten(known: Specimen, tolerance: float = 1e-12) -> Specimen:
    """The same specimen, its zero entries not stored."""
    return Specimen(without_zeros(known.matrix, tolerance), known.points, known.triangles)
