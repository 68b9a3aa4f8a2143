"""The Cramér-Rao bound from 500 to 50,000 vertices, and the unpolished null vector beside it.

The mesh, the bound and the draws are those of ``benchmarks/bound.py``, which differentiates the weights by itself. The
bound is the expectation of the mean square error of the best linear estimate. A few smooth displacements carry most of
either error, so both are compared draw by draw: that ratio settles where the one to the expectation still scatters.
"""

from __future__ import annotations

import numpy as np
import pytest
from bound import Bound, mean_square, mesh_of_at_least, noisy, weights_and_derivative
from irregular import laplacian

from unassemble.matrix import check_matrix
from unassemble.planar import PieceMesh, conformal_map, refined
from unassemble.topology import surfaces

WITHIN = 1.1


class Setting:
    """A mesh, its bound, and its topology, which all draws share."""

    def __init__(self, size: int):
        points, triangles = mesh_of_at_least(size)
        self.matrix, true = laplacian(points, triangles, 1.0)
        place = {tuple(p): k for k, p in enumerate(true)}
        z = true @ [1, 1j]
        self.z = z / (2 * np.abs(z - z.mean()).max())
        cells = np.array([place[tuple(p)] for p in points])[triangles]
        self.bound = Bound(self.z, *weights_and_derivative(self.z, cells))
        checked = check_matrix(self.matrix)
        self.edges = checked.edges
        self.piece = surfaces(checked.n, checked.edges).pieces[0]

    def draw(self, sigma: float, seed: int) -> tuple[float, float, float]:
        """Mean square errors of the polished mesh, of the null vector and of the best linear estimate."""
        given, noise = noisy(self.matrix, sigma, seed)
        checked = check_matrix(given, noise=sigma)
        assert np.array_equal(checked.edges, self.edges)
        weights = -checked.entries[self.piece.edge_rows]
        found = conformal_map(self.piece, weights, sharp=False)
        start = PieceMesh(found.z, found.scale)
        polished = refined(self.piece, weights, start, scale=None, rounding=False)
        assert polished.notes == ()
        linear = np.sum(self.bound.response(-noise[:, None]) ** 2) / len(self.z)
        return (*(mean_square(self._points(mesh), self.z) for mesh in (polished, start)), float(linear))

    def _points(self, mesh: PieceMesh) -> np.ndarray:
        points = np.empty((len(self.z), 2))
        points[self.piece.vertices] = np.column_stack([mesh.z.real, mesh.z.imag])
        return points


@pytest.fixture(scope="module", params=[500, 5000, pytest.param(50_000, marks=pytest.mark.slow)])
def setting(request):
    return request.param, Setting(request.param)


DRAWS = {500: 100, 5000: 8, 50_000: 1}
NULL_VECTOR = {500: 8, 5000: 40, 50_000: 300}  # its mean square error is above the bound by more than this


@pytest.mark.parametrize("sigma", [1e-12, 1e-6, 1e-3])
def test_mean_square_error_is_within_the_cramer_rao_bound(setting, sigma):
    size, known = setting
    assert len(known.z) >= size
    squares = np.array([known.draw(sigma, seed) for seed in range(DRAWS[size])])
    polished, unpolished, linear = squares.mean(axis=0)
    assert polished / linear < WITHIN
    assert polished / linear == pytest.approx(1, abs=0.02)
    assert unpolished / linear > NULL_VECTOR[size]
    if size == 500:  # the bound itself, over 100 draws
        bound = sigma**2 * known.bound.mean_square
        assert polished < WITHIN * bound
        assert unpolished > NULL_VECTOR[size] * bound
