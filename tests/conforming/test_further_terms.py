"""Mass terms, scaled unknowns, convection and complex numbers with other elements than linear triangles."""

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import Basis, BilinearForm, MeshQuad, MeshTri
from skfem.helpers import grad

from conforming.assembled import ELEMENTS, assembled, cell_sets, laplace, largest_error, quadrilaterals, with_hole
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


def test_pieces_with_a_mass_term_are_never_certified_in_wrong_sizes():
    first, s = with_mass("P2", triangles(60, 0), 1.0)
    mesh = triangles(60, 1)
    second = assembled("P2", MeshTri(3 * mesh.p, mesh.t), reaction=s)
    assert status(sp.block_diag([first.matrix, second.matrix], format="csr")) != "certified"


@pytest.mark.parametrize("relative", [1e-1, 1e-4, 1e-7])
@pytest.mark.parametrize("element", ["P2"])
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


@pytest.mark.parametrize(("element", "ratio"), [("Q1", 1.0), ("Q1", -0.01), ("Q2", 1.0), ("S2", 0.1), ("mixed", 0.1)])
def test_a_mass_term_on_quadrilaterals(element, ratio):
    mesh = with_hole(quadrilaterals(9, 8))
    if element == "mixed":
        quads, halves = mesh.t[:, ::2], mesh.t[:, 1::2]
        other = MeshTri(mesh.p, np.hstack([halves[[0, 1, 2]], halves[[0, 2, 3]]]), validate=False)
        known = assembled("mixed", other, MeshQuad(mesh.p, quads, validate=False), c=-2.0, reaction=-2.0 * ratio)
    else:
        known, _ = with_mass(element, mesh, ratio, -2.0)
    found = recover(known.matrix)
    assert found.status == "certified", found.reason
    assert cell_sets(found) == known.cells
    assert largest_error(found.points, known.points) < 1e-9
    assert found.scale == pytest.approx(-2.0, rel=1e-7)
    assert np.sign(found.reaction) == -np.sign(ratio)
    assert found.uniqueness == "searched"


def test_much_mass_on_quadrilaterals_is_named_and_never_certified():
    matrix = with_mass("Q1", quadrilaterals(8, 7), 100.0)[0].matrix
    said = ""
    try:
        found = recover(matrix)
        assert found.status == "uncertified"
        said = found.reason
    except RecoveryError as error:
        said = str(error)
    assert "mass matrix" in said or "No row adds up to zero" in said


@pytest.mark.parametrize(
    ("element", "jacobi"),
    [("P2", False), ("P2", True), ("P3", False), ("Q1", False), ("Q1", True), ("Q2", False), ("S2", False)],
)
def test_scaled_unknowns(element, jacobi):
    known = assembled(element, triangles(60) if element[0] == "P" else quadrilaterals(5, 4), c=-3.0)
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
