"""Meshes and matrices for tests: assembled by scikit-fem, rows always in random order."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import Delaunay
from skfem import Basis, BilinearForm, ElementTriP1, MeshTri
from skfem.helpers import dot, grad

from unassemble import Recovery

SHARED = Path(__file__).resolve().parents[2] / "shared"
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="third-party meshes are not here")


@dataclass(frozen=True, eq=False)
class Specimen:
    """A matrix in random row order, and the mesh that it came from in the same order."""

    matrix: sp.csr_array
    points: NDArray[np.float64]
    triangles: NDArray[np.int64]


def specimen(
    points: NDArray,
    triangles: NDArray,
    *,
    c: float = 1.0,
    diagonal: bool = False,
    tensor: tuple[float, float, float] = (1.0, 0.0, 1.0),
    seed: int = 0,
) -> Specimen:
    """c div(K grad) + D on a mesh, assembled by scikit-fem, zeros stored, rows permuted at random."""
    kxx, kxy, kyy = tensor

    @BilinearForm
    def form(u, v, w):
        g = grad(u)
        return dot(np.stack([kxx * g[0] + kxy * g[1], kxy * g[0] + kyy * g[1]]), grad(v))

    # Centred first: scikit-fem maps elements by differences of coordinates, which lose digits far from the origin.
    centred = points - points.mean(axis=0)
    basis = Basis(MeshTri(np.ascontiguousarray(centred.T), np.ascontiguousarray(triangles.T)), ElementTriP1())
    entries = form.coo_data(basis)  # its own conversion to a matrix would drop zeros
    rng = np.random.default_rng(seed)
    n = len(points)
    place = rng.permutation(n)
    row, column, value = place[entries.indices[0]], place[entries.indices[1]], c * entries.data
    if diagonal:
        row, column = np.append(row, np.arange(n)), np.append(column, np.arange(n))
        value = np.append(value, abs(c) * rng.standard_normal(n))
    matrix = sp.coo_array((value, (row, column)), shape=(n, n)).tocsr()
    shuffled = place[triangles][rng.permutation(len(triangles))]
    return Specimen(matrix, centred[np.argsort(place)], shuffled)


def delaunay(points: NDArray, *, longest: float = np.inf) -> tuple[NDArray, NDArray]:
    """Delaunay mesh without triangles that have a side above `longest`; unused points dropped."""
    triangles = Delaunay(points).simplices
    corner = points[triangles]
    side = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
    used, triangles = np.unique(triangles[side < longest], return_inverse=True)
    return points[used], triangles.reshape(-1, 3)


def random_mesh(n: int, seed: int = 0, *, holes: bool = True) -> tuple[NDArray, NDArray]:
    """Jittered lattice in the unit square, with two holes of more than three edges."""
    rng = np.random.default_rng(seed)
    k = max(int(np.sqrt(n)), 3)
    grid = np.stack(np.meshgrid(np.arange(k), np.arange(k)), axis=-1).reshape(-1, 2)
    points = (grid + rng.uniform(-0.3, 0.3, grid.shape)) / k
    if holes and k >= 12:
        for centre, radius in (((0.3, 0.35), 0.13), ((0.68, 0.6), 0.11)):
            points = points[np.linalg.norm(points - centre, axis=1) > radius]
    return delaunay(points, longest=2.6 / k)


def strip(n: int, height: float, jitter: float, *, seed: int = 0) -> tuple[NDArray, NDArray]:
    """Triangles between two rows of points in zigzag, moved at random; no vertex is inside."""
    rng = np.random.default_rng(seed)
    k = np.arange(n)
    points = np.column_stack([k / 2, k % 2 * height]) + jitter * rng.uniform(-1, 1, (n, 2)) * [1, min(height, 1)]
    even = (k[:-2] % 2 == 0)[:, None]
    return points, np.where(even, np.column_stack([k[:-2], k[2:], k[1:-1]]), np.column_stack([k[:-2], k[1:-1], k[2:]]))


def edge_list(triangles: NDArray) -> NDArray[np.int64]:
    """Pairs i < j in lexicographic order."""
    pairs = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return np.unique(pairs, axis=0).astype(np.int64)


def triangle_set(triangles: NDArray) -> set[tuple[int, ...]]:
    """Triangles as sorted triples."""
    return set(map(tuple, np.sort(triangles, axis=1).tolist()))


def largest_error(points: NDArray, true: NDArray) -> float:
    """Largest distance after the best similarity or reflection, relative to the true diameter."""
    source, target = points @ [1, 1j], true @ [1, 1j]
    source, target = source - source.mean(), target - target.mean()
    fits = [s * (np.vdot(s, target) / np.vdot(s, s)) for s in (source, np.conj(source))]
    return float(min(np.abs(fit - target).max() for fit in fits) / diameter(true))


def largest_error_of_pieces(found: Recovery, true: NDArray) -> float:
    """The same of each piece by itself, the largest of all."""
    pieces = (found.component == label for label in range(found.n_components))
    return max(largest_error(found.points[rows], true[rows]) for rows in pieces)


def diameter(points: NDArray) -> float:
    """Largest extent over directions in steps of a degree."""
    angle = np.deg2rad(np.arange(180))
    return float(np.ptp(points @ np.stack([np.cos(angle), np.sin(angle)]), axis=0).max())
