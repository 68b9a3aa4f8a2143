"""The Cramer-Rao bound of the mean square error of recovered meshes, and the draws of noise that are held against it.

To first order in sigma the best similarity onto the true mesh takes away the component along translations, rotation
and scaling, so the bound is the trace of P C P, P the projector off these four displacements, C = sigma^2 (K'K)^-1 in
any gauge, and K = (I - ww'/w'w) J the derivative of the weights with what a change of the unknown scale c could
explain projected out. P C P = sigma^2 (K'K)^+ since K has no other null vectors. The derivative of linear triangles is
coded here a second time, from dot and cross products, that of others in noise_elements.py; up to 3,000 edges the trace
is exact, above it is the mean over 400 random vectors.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp
from irregular import irregular_mesh
from scipy.sparse.linalg import splu

EXACT, SAMPLES = 3000, 400


def mesh_of_at_least(size: int) -> tuple[np.ndarray, np.ndarray]:
    """An irregular mesh of that many vertices after the islands are cut out."""
    lattice = size
    while True:
        points, triangles = irregular_mesh(lattice)
        if len(points) >= size:
            return points, triangles
        lattice = int(1.02 * lattice) + 1


def noisy(matrix: sp.csr_array, sigma: float, seed: int | list[int]) -> tuple[sp.coo_array, np.ndarray]:
    """The matrix with errors, and the errors (e,) of its upper triangle."""
    upper = sp.triu(matrix, 1).tocsr()
    upper.sort_indices()
    upper = upper.tocoo()
    noise = sigma * np.random.default_rng(seed).standard_normal(upper.nnz)
    value = upper.data + noise
    ends = np.r_[upper.row, upper.col], np.r_[upper.col, upper.row]
    return sp.coo_array((np.r_[value, value], ends), shape=matrix.shape), noise


def mean_square(points: np.ndarray, z: np.ndarray) -> float:
    """After the best similarity or reflection."""
    source, target = points @ [1, 1j], z - z.mean()
    source = source - source.mean()
    fits = [s * (np.vdot(s, target) / np.vdot(s, s)) for s in (source, source.conj())]
    return float(min(np.mean(np.abs(fit - target) ** 2) for fit in fits))


def weights_and_derivative(z: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, sp.csr_array]:
    """w (e,) and dw / d(x, y) (e, 2 v), from cot = dot / cross."""
    n = len(z)
    rows, columns, slopes, cots = [], [], [], []
    sides = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    edges, edge = np.unique(sides, axis=0, return_inverse=True)
    edge = edge.reshape(-1, 3)
    for k in range(3):
        corner, a, b = (triangles[:, (k + s) % 3] for s in range(3))
        u, v = z[a] - z[corner], z[b] - z[corner]
        dot, cross = (u.conj() * v).real, (u.conj() * v).imag
        sign = np.sign(cross)
        cots.append((edge[:, k], sign * dot / cross / 2))
        # d dot = v.du + u.dv, d cross = (v.y, -v.x).du + (-u.y, u.x).dv, as complex gradients.
        to_a, to_b = (v / cross + 1j * v * dot / cross**2, u / cross - 1j * u * dot / cross**2)
        for vertex, g in ((a, to_a), (b, to_b), (corner, -to_a - to_b)):
            for part, value in ((0, g.real), (1, g.imag)):
                rows.append(edge[:, k])
                columns.append(2 * vertex + part)
                slopes.append(sign * value / 2)
    w = np.zeros(len(edges))
    for place, value in cots:
        np.add.at(w, place, value)
    indices = np.concatenate(rows), np.concatenate(columns)
    return w, sp.coo_array((np.concatenate(slopes), indices), shape=(len(edges), 2 * n)).tocsr()


class Bound:
    """The best linear estimate, and its mean square error."""

    def __init__(self, z: np.ndarray, w: np.ndarray, derivative: sp.csr_array):
        self.w, self.derivative = w, derivative
        n = len(z)
        centred = z - z.mean()
        first = int(np.abs(centred).argmax())
        self.free = np.ones(2 * n, dtype=bool)
        for pin in (first, int(np.abs(z - z[first]).argmax())):
            self.free[[2 * pin, 2 * pin + 1]] = False
        self.held = self.derivative[:, self.free]
        self.factor = splu((self.held.T @ self.held).tocsc())
        one = np.ones(n)
        fields = [one + 0j, 1j * one, centred, 1j * centred]
        self.gauge = np.linalg.qr(np.column_stack([np.column_stack([f.real, f.imag]).ravel() for f in fields]))[0]
        self.along = self.fitted(self.w[:, None])
        self.rest = self.w - self.derivative @ self.along[:, 0]  # what no displacement explains of w

    @cached_property
    def mean_square(self) -> float:
        """Expected mean square error for sigma = 1: trace of P C P over the number of vertices."""
        return self.trace() / (self.derivative.shape[1] / 2)

    def fitted(self, noise: np.ndarray) -> np.ndarray:
        """Displacements (2 v, k) that fit errors (e, k) of the weights for known c."""
        full = np.zeros((self.derivative.shape[1], noise.shape[1]))
        full[self.free] = self.factor.solve(self.held.T @ noise)
        return full

    def response(self, noise: np.ndarray) -> np.ndarray:
        """The same for unknown c, and without translations, rotation and scaling."""
        y = self.fitted(noise) - self.along * (self.rest @ noise / (self.rest @ self.w))
        return y - self.gauge @ (self.gauge.T @ y)

    def trace(self) -> float:
        """Sum of squares of the responses to every entry, or to as many random vectors as estimate it."""
        edges, rng, total = len(self.w), np.random.default_rng(1), 0.0
        count = edges if edges <= EXACT else SAMPLES
        for first in range(0, count, 50):
            width = min(50, count - first)
            if edges <= EXACT:
                noise = np.eye(edges)[:, first : first + width]
            else:
                noise = rng.standard_normal((edges, width)) / SAMPLES**0.5
            total += float(np.sum(self.response(noise) ** 2))
        return total
