"""Small meshes with dense matrices, assembled by scikit-fem: slow and plain, to hold formulas and code against."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.spatial import Delaunay
from skfem.models.poisson import laplace


@dataclass(frozen=True, eq=False)
class Mesh:
    """Counter-clockwise triangles `t` (m, 3) on points `p` (n,) complex."""

    p: NDArray
    t: NDArray

    @property
    def n(self) -> int:
        return len(self.p)

    @cached_property
    def stiffness(self) -> NDArray:
        """L."""
        points = np.ascontiguousarray([self.p.real, self.p.imag])
        basis = skfem.Basis(skfem.MeshTri(points, np.ascontiguousarray(self.t.T)), skfem.ElementTriP1())
        return laplace.assemble(basis).toarray()

    @cached_property
    def boundary(self) -> NDArray:
        """Directed edges with the mesh on their left."""
        half = np.vstack([self.t[:, [0, 1]], self.t[:, [1, 2]], self.t[:, [2, 0]]]).tolist()
        present = {(a, b) for a, b in half}
        return np.array([(a, b) for a, b in half if (b, a) not in present])

    @cached_property
    def loops(self) -> list[NDArray]:
        """The boundary cut into loops (k, 2); no loop may touch another."""
        successor = dict(self.boundary.tolist())
        loops = []
        while successor:
            a = min(successor)
            loop = []
            while a in successor:
                b = successor.pop(a)
                loop.append((a, b))
                a = b
            loops.append(np.array(loop))
        return loops

    @cached_property
    def area_matrix(self) -> NDArray:
        """T."""
        return area_matrix(self.n, self.boundary)

    @property
    def energy(self) -> NDArray:
        """M = L/2 - T."""
        return self.stiffness / 2 - self.area_matrix

    @cached_property
    def sides(self) -> NDArray:
        """(m, 3) complex edge vectors, each facing its corner."""
        q = self.p[self.t]
        return np.roll(q, 1, axis=1) - np.roll(q, -1, axis=1)

    @cached_property
    def areas(self) -> NDArray:
        return signed_areas(self.p, self.t)

    @property
    def circumradii(self) -> NDArray:
        return np.abs(self.sides).prod(axis=1) / (4 * self.areas)

    @cached_property
    def edges(self) -> tuple[NDArray, NDArray]:
        """Undirected edges (e, 2), and the edge facing each corner (3 m,): all first corners, all second, all third."""
        half = np.sort(np.vstack([self.t[:, [1, 2]], self.t[:, [2, 0]], self.t[:, [0, 1]]]), axis=1)
        return np.unique(half, axis=0, return_inverse=True)

    def weights(self, z: NDArray) -> NDArray:
        """w_e of positions z on these triangles."""
        q = z[self.t]
        u, w = np.roll(q, -1, axis=1) - q, np.roll(q, 1, axis=1) - q
        cotangent = (u.conj() * w).real / (u.conj() * w).imag
        return np.bincount(self.edges[1], cotangent.T.ravel()) / 2

    def weight_change(self, d: NDArray) -> NDArray:
        """J d from d cot(gamma) = -Im(dw/w - du/u) / sin(gamma)^2."""
        q, dq = self.p[self.t], d[self.t]
        u, w = np.roll(q, -1, axis=1) - q, np.roll(q, 1, axis=1) - q
        du, dw = np.roll(dq, -1, axis=1) - dq, np.roll(dq, 1, axis=1) - dq
        sine = (u.conj() * w).imag / np.abs(u * w)
        return np.bincount(self.edges[1], (-(dw / w - du / u).imag / sine**2).T.ravel()) / 2

    @cached_property
    def jacobian(self) -> NDArray:
        """J (e, 2 n), columns x then y."""
        return np.column_stack([self.weight_change(s * e) for s in (1, 1j) for e in np.eye(self.n)])

    def graph_laplacian(self, weights: NDArray) -> NDArray:
        """Entries -weights off the diagonal; rows sum to zero."""
        matrix = np.zeros((self.n, self.n))
        i, j = self.edges[0].T
        matrix[i, j] = matrix[j, i] = -weights
        return matrix - np.diag(matrix.sum(axis=1))


def signed_areas(p: NDArray, t: NDArray) -> NDArray:
    q = p[t]
    return ((q[:, 1] - q[:, 0]).conj() * (q[:, 2] - q[:, 0])).imag / 2


def area_matrix(n: int, boundary: NDArray) -> NDArray:
    """The area form of directed edges a -> b: 1/(4i) at (a, b), -1/(4i) at (b, a)."""
    form = np.zeros((n, n), dtype=complex)
    np.add.at(form, tuple(boundary.T), -0.25j)
    np.add.at(form, tuple(boundary[:, ::-1].T), 0.25j)
    return form


def triangulate(points: NDArray, holes: Sequence[tuple[complex, float]] = ()) -> Mesh:
    """Delaunay triangles whose centroids lie outside the discs (centre, radius) of `holes`."""
    t = Delaunay(np.column_stack([points.real, points.imag])).simplices.astype(np.int64)
    area = signed_areas(points, t)
    t = np.where((area < 0)[:, None], t[:, [0, 2, 1]], t)
    kept = np.abs(area) > 1e-9
    for centre, radius in holes:
        kept &= np.abs(points[t].mean(axis=1) - centre) >= radius
    used, t = np.unique(t[kept], return_inverse=True)
    return Mesh(points[used], t.reshape(-1, 3))


def square(k: int, holes: Sequence[tuple[complex, float]] = (), seed: int = 0) -> Mesh:
    """The unit square on k x k points, shaken in the interior, less discs."""
    grid = np.add.outer(1j * np.arange(k), np.arange(k)).ravel() / (k - 1)
    inner = (grid.real > 0) & (grid.real < 1) & (grid.imag > 0) & (grid.imag < 1)
    return triangulate(grid + inner * _shake(k * k, 0.25 / (k - 1), np.random.default_rng(seed)), holes)


def disc(k: int, seed: int = 0) -> Mesh:
    """The unit disc on k rings of points, turned at random and shaken inside."""
    rng = np.random.default_rng(seed)
    rings = [np.zeros(1, complex)]
    for i in range(1, k + 1):
        ring = i / k * np.exp(2j * np.pi * (np.arange(6 * i) + (i < k) * rng.uniform()) / (6 * i))
        rings.append(ring + (i < k) * _shake(6 * i, 0.2 / k, rng))
    return triangulate(np.concatenate(rings))


def lattice(k: int) -> Mesh:
    """A rhombus of k x k points of the lattice of equilateral triangles, side 1."""
    j, i = np.divmod(np.arange(k * k), k)
    corner = np.arange(k * k).reshape(k, k)[:-1, :-1].ravel()[:, None]
    t = np.vstack([corner + [0, 1, k], corner + [1, k + 1, k]])
    return Mesh((i + j * np.exp(1j * np.pi / 3)) / (k - 1), t)


def noise(n: int, seed: int = 1) -> NDArray:
    """Complex normal numbers (n,)."""
    return np.random.default_rng(seed).standard_normal((n, 2)).view(complex).ravel()


def _shake(n: int, size: float, rng: np.random.Generator) -> NDArray:
    return rng.uniform(-size, size, (n, 2)).view(complex).ravel()
