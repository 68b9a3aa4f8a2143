"""Where second moments tie the axes follow the edges: grids lie straight."""

from __future__ import annotations

import numpy as np
import pyamg
import pytest
import scipy.sparse as sp
from skfem import Basis, ElementTriP1, MeshTri
from skfem.models.poisson import laplace

from unassemble import recover


def shuffled(A, seed):
    place = np.random.default_rng(seed).permutation(A.shape[0])
    return sp.csr_array(A)[place][:, place]


def square_grid(kind):
    mesh = {"one diagonal": MeshTri().refined(3), "crossed": MeshTri.init_sqsymmetric().refined(2)}[kind]
    return laplace.assemble(Basis(mesh, ElementTriP1()))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["one diagonal", "crossed"])
def test_square_grids(kind, seed):
    found = recover(shuffled(square_grid(kind), seed))
    assert found.certified, found.reason
    line = found.points[found.boundary[:, 1]] - found.points[found.boundary[:, 0]]
    assert np.abs(line).min(axis=1).max() < 1e-9  # along x or y
    assert any("follow the edges" in note for note in found.warnings)


def test_five_point_stencil():
    A = pyamg.gallery.poisson((7, 7), format="csr")
    found = recover(shuffled(A, 1))
    for column in found.points.T:
        assert len(np.unique(np.round(column, 6))) == 7


def test_a_disc_of_six_sides_lies_on_one_of_them():
    corners = np.exp(1j * np.pi / 3 * np.arange(6))
    points = np.append(0, corners)
    triangles = np.array([[0, 1 + k, 1 + (k + 1) % 6] for k in range(6)])
    mesh = MeshTri(np.stack([points.real, points.imag]), triangles.T).refined(2)
    found = recover(shuffled(laplace.assemble(Basis(mesh, ElementTriP1())), 2))
    line = (found.points[found.boundary[:, 1]] - found.points[found.boundary[:, 0]]) @ [1, 1j]
    turned = np.angle(line**6) / 6
    assert np.abs(turned).max() < 1e-9
