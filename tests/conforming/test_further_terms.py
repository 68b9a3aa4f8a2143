"""Mass terms, scaled unknowns, convection and complex numbers with other elements than linear triangles."""

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import Basis, BilinearForm, MeshTri
from skfem.helpers import grad

from conforming.assembled import ELEMENTS, assembled, cell_sets, laplace, largest_error, quadrilaterals
from meshes import random_mesh
from unassemble import RecoveryError, inspect_matrix, recover


def triangles(n=200, seed=0):
    points, cells = random_mesh(n, seed)
    return MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))


def with_mass(element, mesh, ratio, c=1.0, seed=0):
    """s h^2 / c is `ratio`, h^2 the mean area."""
    x, y = mesh.p[:, mesh.t]
    area = np.abs((np.roll(y, -1, axis=0) * x - np.roll(x, -1, axis=0) * y).sum(axis=0)).mean() / 2
    return assembled(element, mesh, c=c, reaction=c * ratio / area, seed=seed), c * ratio / area


@pytest.mark.parametrize("c", [1.0, -1e3])
@pytest.mark.parametrize("ratio", [1e-3, 1.0, 100.0, -0.01])
@pytest.mark.parametrize("element", ["P2", "P3"])
def test_a_mass_term_gives_the_mesh_a_size(element, ratio, c):
    known, s = with_mass(element, triangles(150 if element == "P2" else 50), ratio, c)
    found = recover(known.matrix)
    assert found.status == "certified", found.reason
    assert found.element == element
    assert cell_sets(found) == known.cells
    assert largest_error(found.points, known.points) < 1e-9
    assert found.scale == pytest.approx(c, rel=1e-9)
    sizes = [np.linalg.norm(some - some.mean(axis=0)) for some in (found.points, known.points)]
    assert sizes[0] * np.sqrt(found.reaction / s) == pytest.approx(sizes[1], rel=1e-9)
    if ratio > 0:
        assert "mass matrix, as of a reaction" in inspect_matrix(known.matrix).operator


@pytest.mark.parametrize("relative", [1e-1, 1e-4, 1e-7])
@pytest.mark.parametrize("element", ["P2", "P3"])
def test_one_entry_changed_beside_a_mass_term(element, relative):
    matrix = with_mass(element, triangles(50), 1.0)[0].matrix.tolil()
    i, j = next((i, j) for i, j in zip(*matrix.nonzero(), strict=True) if i < j and abs(matrix[i, j]) > 0.1)
    matrix[i, j] = matrix[j, i] = matrix[i, j] * (1 + relative)
    assert status(matrix.tocsr()) != "certified"
    diagonal = with_mass(element, triangles(50), 1.0)[0].matrix.tolil()
    diagonal[i, i] *= 1 + relative
    assert status(diagonal.tocsr()) != "certified"


def status(matrix):
    try:
        return recover(matrix).status
    except RecoveryError:
        return "failed"


@pytest.mark.parametrize("ratio", [1e-3, 1.0, 100.0])
@pytest.mark.parametrize("element", ["Q1", "Q2"])
def test_a_mass_term_on_quadrilaterals_is_named_and_never_certified(element, ratio):
    matrix = with_mass(element, quadrilaterals(8, 7), ratio)[0].matrix
    said = ""
    try:
        found = recover(matrix)
        assert found.status == "uncertified"
        said = found.reason
    except RecoveryError as error:
        said = str(error)
    assert "mass matrix" in said or "No row adds up to zero" in said


@pytest.mark.parametrize("jacobi", [False, True])
@pytest.mark.parametrize("element", ["P2", "P3", "Q1", "Q2", "S2"])
def test_scaled_unknowns(element, jacobi):
    known = assembled(element, triangles(60) if element[0] == "P" else quadrilaterals(9, 8), c=-3.0)
    S = np.random.default_rng(1).uniform(0.5, 2, len(known.points))
    if jacobi:
        S = 1 / np.sqrt(-known.matrix.diagonal())
    scaled = sp.csr_array(sp.diags_array(S) @ known.matrix @ sp.diags_array(S))
    found = recover(scaled)
    assert found.status == "certified", found.reason
    assert cell_sets(found) == known.cells
    assert largest_error(found.points, known.points) < 1e-9
    assert found.row_scaling == pytest.approx(S / np.exp(np.log(S).mean()), rel=1e-9)
    changed = scaled.copy()
    changed[0, 0] *= 1 + 1e-7
    assert status(changed) != "certified"
    assert "with rows and columns scaled" in inspect_matrix(scaled).operator


@pytest.mark.parametrize("element", ["P2", "Q1"])
def test_convection_and_complex_numbers(element):
    mesh = triangles() if element == "P2" else quadrilaterals(9, 8)
    basis = Basis(mesh, ELEMENTS[element]())
    stream = np.random.default_rng(5).standard_normal(basis.N)
    stream[basis.get_dofs().all()] = 0  # no flow through the boundary

    @BilinearForm
    def convection(u, v, w):
        along = w["stream"].grad
        return (along[1] * grad(u)[0] - along[0] * grad(u)[1]) * v

    laplacian = laplace.assemble(basis).tocsr()
    carried = convection.assemble(basis, stream=basis.interpolate(stream)).tocsr()
    place = np.random.default_rng(0).permutation(basis.N)
    for matrix, said in (
        (laplacian + carried, "its symmetric part was taken"),
        (laplacian + 1j * sp.diags_array(np.arange(float(basis.N))), "its real part was taken"),
    ):
        found = recover(matrix[place][:, place])
        assert found.status == "certified", found.reason
        assert found.element == element
        assert any(said in note for note in found.warnings)
    through = carried + sp.diags_array(np.ones(basis.N - 1), offsets=1)
    with pytest.raises(RecoveryError, match="not symmetric"):
        recover(laplacian + through)
