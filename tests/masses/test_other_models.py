"""Matrices that another model has entry by entry: the answer is ambiguous, and nothing is said to be proved."""

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementQuad1, ElementTriP1, MeshQuad, MeshTri
from skfem.helpers import dot, grad
from skfem.models.poisson import laplace, mass

from unassemble import RecoveryError, recover


def lattice(rows, columns, shear=0.3, height=0.9, kind=MeshTri):
    """Equal parallelograms, halved if `kind` has triangles."""
    mesh = kind.init_tensor(np.arange(columns + 1.0), np.arange(rows + 1.0))
    return kind(np.array([[1, shear], [0, height]]) @ mesh.p, mesh.t)


def shuffled(matrix, seed=0):
    order = np.random.default_rng(seed).permutation(matrix.shape[0])
    return sp.csr_array(matrix)[order][:, order]


def parts(mesh):
    basis = Basis(mesh, ElementTriP1())
    return sp.csr_array(laplace.assemble(basis)), sp.csr_array(mass.assemble(basis))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("lumped", [False, True])
def test_a_mass_term_on_equal_triangles(lumped, seed):
    """A consistent one is a lumped one on triangles of another shape."""
    L, M = parts(lattice(4, 5, shear=0.2 + 0.1 * seed))
    M = sp.diags_array(M.sum(axis=1)) if lumped else M
    found = recover(shuffled(1.3 * L + 0.4 * M, seed))
    assert (found.status, found.uniqueness) == ("ambiguous", "ambiguous")
    assert "all triangles are alike" in found.reason


def test_a_lumped_mass_term_on_triangles_that_differ_is_unique():
    mesh = lattice(4, 5)
    inside = mesh.interior_nodes()
    mesh.p[:, inside] += np.random.default_rng(0).uniform(-0.1, 0.1, (2, len(inside)))
    L, M = parts(mesh)
    found = recover(shuffled(1.3 * L + 0.4 * sp.diags_array(M.sum(axis=1))))
    assert (found.status, found.uniqueness) == ("certified", "proved")


@pytest.mark.parametrize("shape", [(2, 3), (4, 5), (6, 6)])
def test_a_mass_matrix_of_equal_triangles_has_no_shape(shape):
    """It was read as c L + s M, with a negative c and lumped masses, on triangles of another shape."""
    _, M = parts(lattice(*shape))
    found = recover(shuffled(2.5 * M))
    assert found.operator == "mass"
    assert (found.status, found.uniqueness) == ("certified", "searched")
    assert found.areas == pytest.approx(2.5 * 0.45, rel=1e-10)
    assert any("all areas are equal" in warning for warning in found.warnings)


@pytest.mark.parametrize("shape", [(3, 4), (4, 3)])
def test_a_mass_matrix_of_few_quadrilaterals_is_no_stiffness_matrix(shape):
    mesh = lattice(*shape, shear=0.5, kind=MeshQuad)
    inside = mesh.interior_nodes()
    matrix = sp.csr_array(mass.assemble(Basis(mesh, ElementQuad1())))[inside][:, inside]
    try:
        found = recover(shuffled(matrix))
    except RecoveryError:
        return
    assert not found.certified


def symmetrised_convection(mesh, field):
    """The symmetric part of the Laplacian with a convection by a constant field."""

    @BilinearForm
    def form(u, v, _):
        gradient = grad(u)
        return dot(gradient, grad(v)) + (field[0] * gradient[0] + field[1] * gradient[1]) * v

    matrix = sp.csr_array(form.assemble(Basis(mesh, ElementTriP1())))
    return (matrix + matrix.T) / 2


@pytest.mark.parametrize("seed", range(12))
def test_a_flow_through_the_boundary_is_not_overlooked(seed):
    """On grids of few points other meshes have the entries without a flow, points off by up to half of the size."""
    rng = np.random.default_rng(seed)
    mesh = MeshTri.init_tensor(np.arange(rng.integers(3, 6)) * 1.0, np.arange(rng.integers(3, 6)) * 1.0)
    matrix = symmetrised_convection(mesh, rng.uniform(-2, 2, 2))
    order = rng.permutation(mesh.nvertices)
    found = recover(sp.csr_array(matrix)[order][:, order])
    if found.certified:
        a, b = ((p - p.mean(axis=0)) @ [1, 1j] for p in (found.points, mesh.p.T[order]))
        assert min(np.abs(np.vdot(z, b) / np.vdot(z, z) * z - b).max() for z in (a, a.conj())) <= 1e-9
