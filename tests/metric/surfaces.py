"""Surfaces in space, and their matrices: each triangle laid into the plane, assembled by scikit-fem, and glued."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from skfem import Basis, BilinearForm, ElementTriP1, MeshTri
from skfem.helpers import dot, grad

from unassemble import Surface


@dataclass(frozen=True, eq=False)
class Specimen:
    """A matrix in random row order, and the surface that it came from in the same order."""

    matrix: sp.csr_array
    points: NDArray[np.float64]
    triangles: NDArray[np.int64]


@BilinearForm
def _form(u, v, w):
    return dot(grad(u), grad(v))


def surface(points: NDArray, triangles: NDArray, *, c: float = 1.0, diagonal: NDArray | None = None, seed: int = 0):
    """c L + D on a surface, zeros stored, rows permuted at random."""
    a, b, d = points[triangles].transpose(1, 0, 2)
    length = np.linalg.norm(b - a, axis=1)
    along = ((d - a) * (b - a)).sum(axis=1) / length
    height = np.linalg.norm(np.cross(b - a, d - a), axis=1) / length
    nothing = np.zeros(len(a))
    apart = np.stack([np.stack([nothing, length, along], 1), np.stack([nothing, nothing, height], 1)]).reshape(2, -1)
    basis = Basis(MeshTri(apart, np.arange(triangles.size).reshape(-1, 3).T.copy()), ElementTriP1())
    entries = _form.coo_data(basis)
    rng = np.random.default_rng(seed)
    n = len(points)
    place = rng.permutation(n)
    row, column = (place[triangles.ravel()[index]] for index in entries.indices)
    value = c * entries.data
    if diagonal is not None:
        row, column, value = (np.append(*pair) for pair in ((row, place), (column, place), (value, diagonal)))
    matrix = sp.coo_array((value, (row, column)), shape=(n, n)).tocsr()
    return Specimen(matrix, points[np.argsort(place)], place[triangles][rng.permutation(len(triangles))])


def largest_error(found: Surface, true: NDArray) -> float:
    """Largest relative error of a length, after the best factor for each piece."""
    length = np.linalg.norm(true[found.edges[:, 0]] - true[found.edges[:, 1]], axis=1)
    ratio = found.edge_lengths / length
    worst = 0.0
    for piece in range(found.n_components):
        sides = found.triangles[_piece_of_triangles(found) == piece][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        own = np.isin(found.edges @ [found.n_points, 1], np.sort(sides, axis=1) @ [found.n_points, 1])
        worst = max(worst, float(ratio[own].max() / ratio[own].min() - 1))
    return worst


def _piece_of_triangles(found: Surface) -> NDArray:
    """A vertex of one piece only tells the piece of its triangle."""
    lone = ~np.isin(found.triangles, found.hinges)
    first = np.argmax(lone, axis=1)
    return found.component[found.triangles[np.arange(len(first)), first]]


def sphere(n: int, seed: int = 0) -> tuple[NDArray, NDArray]:
    """A bumpy, stretched sphere with random vertices."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((n, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    triangles = ConvexHull(points).simplices.astype(np.int64)
    return points * (1 + 0.2 * np.sin(5 * points[:, :1]) * np.cos(4 * points[:, 1:2])) * [1, 1.5, 0.7], triangles


def lattice(k: int, m: int, *, round_k: bool, round_m: bool, twisted: bool = False) -> NDArray[np.int64]:
    """Triangles of k x m vertices, closed in one direction or both; `twisted` turns the second over at the seam."""
    i, j = (
        part.ravel() for part in np.meshgrid(np.arange(k - (not round_k)), np.arange(m - (not round_m)), indexing="ij")
    )

    def at(a: NDArray, b: NDArray) -> NDArray:
        turned = (a >= k) & twisted
        return (a % k) * m + np.where(turned, m - 1 - b, b) % m

    corner = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
    return np.concatenate([np.stack([corner[p] for p in some], 1) for some in ((0, 1, 2), (0, 2, 3))])


def torus(k: int = 24, m: int = 12, seed: int = 0) -> tuple[NDArray, NDArray]:
    rng = np.random.default_rng(seed)
    i, j = np.divmod(np.arange(k * m), m)
    s, t = 2 * np.pi * (i + rng.uniform(-0.3, 0.3, k * m)) / k, 2 * np.pi * (j + rng.uniform(-0.2, 0.2, k * m)) / m
    width = 2 + np.cos(t)
    return np.stack([width * np.cos(s), width * np.sin(s), np.sin(t)], 1), lattice(k, m, round_k=True, round_m=True)


def moebius(k: int = 30, m: int = 5, seed: int = 0) -> tuple[NDArray, NDArray]:
    rng = np.random.default_rng(seed)
    i, j = np.divmod(np.arange(k * m), m)
    s, t = 2 * np.pi * i / k, (j - (m - 1) / 2) / m
    points = np.stack([(2 + t * np.cos(s / 2)) * np.cos(s), (2 + t * np.cos(s / 2)) * np.sin(s), t * np.sin(s / 2)], 1)
    points += rng.uniform(-0.03, 0.03, points.shape)
    return points, lattice(k, m, round_k=True, round_m=False, twisted=True)


def sheet(k: int = 24, seed: int = 0, *, holes: bool = True) -> tuple[NDArray, NDArray]:
    """A wavy sheet with two holes of many edges."""
    rng = np.random.default_rng(seed)
    x, y = np.divmod(np.arange(k * k), k)
    xy = np.stack([x, y], 1) / k + rng.uniform(-0.2, 0.2, (k * k, 2)) / k
    points = np.column_stack([xy, 0.2 * np.sin(7 * xy[:, 0]) * np.cos(5 * xy[:, 1])])
    triangles = lattice(k, k, round_k=False, round_m=False)
    if holes:
        gone = (np.hypot(*(xy - [0.3, 0.3]).T) < 0.13) | (np.hypot(*(xy - [0.7, 0.65]).T) < 0.1)
        triangles = triangles[~gone[triangles].any(axis=1)]
    used, triangles = np.unique(triangles, return_inverse=True)
    return points[used], triangles.reshape(-1, 3)


def double_torus(seed: int = 0) -> tuple[NDArray, NDArray]:
    """Two tori glued along the rims of a hole of six edges in each."""
    points, triangles = torus(seed=seed)
    hub = 5
    star = triangles[(triangles == hub).any(axis=1)]
    rest = triangles[(triangles != hub).all(axis=1)]
    rim = np.setdiff1d(star, [hub])
    n = len(points)
    again = np.arange(n) + n
    again[rim] = rim
    # The second one is the mirror image beyond the rim, bent a little.
    centre, normal = points[rim].mean(axis=0), points[hub] / np.linalg.norm(points[hub])
    mirrored = points - 2 * ((points - centre) @ normal)[:, None] * normal
    whole = np.concatenate([points, 1.1 * mirrored])
    both = np.concatenate([rest, again[rest]])
    used, both = np.unique(both, return_inverse=True)
    return whole[used], both.reshape(-1, 3)
