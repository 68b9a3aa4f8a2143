"""Boundary conditions in matrices of other elements than linear triangles."""

import numpy as np
import pytest
import scipy.sparse as sp
from conditions import determined, eliminated, identity_rows, jittered, mesh_of, shuffled
from skfem import Basis, ElementQuad1, ElementQuad2, ElementTriP2, ElementTriP3, MeshQuad
from skfem.models import laplace, mass

from meshes import SHARED, needs_shared
from unassemble import RecoveryError, recover

ELEMENTS = {"P2": ElementTriP2(), "P3": ElementTriP3(), "Q1": ElementQuad1(), "Q2": ElementQuad2()}


def quadrilaterals(n: int, m: int, seed: int = 0) -> MeshQuad:
    """A lattice of squares, vertices moved inside and the outline stretched."""
    mesh = MeshQuad.init_tensor(np.arange(n + 1.0) ** 1.1, np.arange(m + 1.0))
    move = np.random.default_rng(seed).uniform(-0.2, 0.2, mesh.p.shape)
    return MeshQuad((mesh.p + move) / n, mesh.t)


def drawn(name: str, seed: int) -> MeshQuad:
    return quadrilaterals(11, 9, seed) if name.startswith("Q") else jittered(2, seed)


@pytest.mark.parametrize("zeros", ["stored", "dropped"])
@pytest.mark.parametrize("name", ELEMENTS)
def test_eliminated(name, zeros):
    matrix, points = eliminated(drawn(name, 1), element=ELEMENTS[name])
    if zeros == "dropped":
        matrix.data[np.abs(matrix.data) < 1e-14] = 0
        matrix.eliminate_zeros()
    found = recover(-2.5 * matrix)
    assert found.certified, found.reason
    assert found.element == name
    assert determined(found, points) >= {"P2": 0.65, "P3": 0.55, "Q1": 0.95, "Q2": 0.7}[name]
    assert found.scale == pytest.approx(-2.5, rel=1e-9)


@pytest.mark.parametrize("name", ELEMENTS)
def test_eliminated_in_part(name):
    """What is left of the boundary is that of the mesh, and its rows add up."""
    matrix, points = eliminated(drawn(name, 2), lambda x: x[0] < 0.5, ELEMENTS[name])
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.8


@pytest.mark.parametrize("name", ELEMENTS)
def test_identity_rows(name):
    matrix, points = identity_rows(drawn(name, 3), 7.0, ELEMENTS[name])
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.9
    assert found.scale == pytest.approx(7.0, rel=1e-9)


def test_anchors_and_tensor():
    mesh = quadrilaterals(9, 9, 5)
    basis = Basis(mesh, ElementQuad1())
    stretched = Basis(MeshQuad(np.array([[2.0], [0.5]]) * mesh.p, mesh.t), ElementQuad1())  # of K = diag(1/4, 4)
    inside = np.setdiff1d(np.arange(basis.N), basis.get_dofs().all())
    matrix, points = shuffled(sp.csr_array(laplace.assemble(stretched)[inside][:, inside]), mesh.p.T[inside])
    anchors = [(row, *points[row]) for row in (0, 5, 11)]
    found = recover(matrix, tensor=(0.25, 0.0, 4.0), anchors=anchors, scale=1.0)
    assert found.certified, found.reason
    known = found.node_status == 0
    assert known[[0, 5, 11]].all()
    assert np.abs(found.points - points)[known].max() <= 1e-9


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("seed", range(3))
def test_a_vertex_that_only_one_of_two_pieces_determines(seed, order):
    """Its place in the other one is no more than plausible."""
    first, second = quadrilaterals(9, 8, seed), quadrilaterals(8, 9, seed + 50)
    top = int(np.argmin(np.linalg.norm(first.p.T - [np.median(first.p[0]), first.p[1].max()], axis=1)))
    corner = int(np.argmin(second.p.sum(axis=0)))
    place = np.insert(np.arange(second.nvertices - 1) + first.nvertices, corner, top)
    n = first.nvertices + second.nvertices - 1
    whole, points = sp.csr_array((n, n)), np.zeros((n, 2))
    for mesh, rows in ((second, place), (first, np.arange(first.nvertices))):
        part = sp.coo_array(laplace.assemble(Basis(mesh, ElementQuad1())))
        whole = whole + sp.coo_array((part.data, (rows[part.row], rows[part.col])), shape=(n, n))
        points[rows] = mesh.p.T - mesh.p.T[np.flatnonzero(rows == top)]
    sides = first.facets[:, first.boundary_facets()]
    beside = sides[:, (sides == top).any(axis=0)].ravel()
    gone = np.setdiff1d(first.boundary_nodes(), [top, beside[beside != top][0]])
    kept = np.setdiff1d(np.arange(n), gone)[::order]
    found = recover(sp.csr_array(whole[kept][:, kept]))
    assert found.certified, found.reason
    assert determined(found, points[kept]) >= 0.9


def test_anchors_of_points_that_are_not_determined():
    mesh = quadrilaterals(9, 8)
    sides = mesh.facets[:, mesh.boundary_facets()].T
    gone = np.setdiff1d(mesh.boundary_nodes(), [*sides[3], *sides[len(sides) // 2]])  # two sides stay
    inside = np.setdiff1d(np.arange(mesh.nvertices), gone)
    whole = laplace.assemble(Basis(mesh, ElementQuad1()))
    matrix, points = shuffled(sp.csr_array(whole[inside][:, inside]), mesh.p.T[inside])
    status = recover(matrix).node_status
    loose, firm = np.flatnonzero(status == 2), np.flatnonzero(status == 0)[[0, 9, 20]]
    assert len(loose)
    found = recover(matrix, anchors=[(row, *points[row]) for row in (*firm, loose[0])])
    assert any("anchors were not used" in note for note in found.warnings)
    assert np.abs(found.points - points)[status == 0].max() <= 1e-9


def share_at_most(matrix: sp.csr_array, points: np.ndarray) -> float:
    """Of the points that are said to be determined, after a check that they are right; none where there is no mesh."""
    try:
        found = recover(matrix)
    except RecoveryError:
        return 0.0
    return determined(found, points) if found.certified else 0.0


def test_nodes_that_could_change_places():
    """In a row of squares what is above and what is below its axis can be exchanged, square by square."""
    matrix, points = identity_rows(MeshQuad.init_tensor(np.arange(9.0), np.arange(2.0)), element=ElementQuad2())
    assert share_at_most(matrix, points) < 0.5


@pytest.mark.parametrize("name", ELEMENTS)
def test_with_a_mass_term(name):
    """Row sums say nothing of lost cells then."""
    basis = Basis(drawn(name, 4), ELEMENTS[name])
    inside = np.setdiff1d(np.arange(basis.N), basis.get_dofs().all())
    whole = laplace.assemble(basis) + 5 * mass.assemble(basis)
    share_at_most(*shuffled(sp.csr_array(whole[inside][:, inside]), basis.doflocs.T[inside]))


@pytest.mark.parametrize("name", ELEMENTS)
def test_a_wrong_entry_is_not_certified(name):
    matrix, points = eliminated(drawn(name, 6), element=ELEMENTS[name])
    row = int(np.argmin(np.abs(matrix.sum(axis=1))))
    column = int(np.argsort(-np.abs(matrix[[row]].toarray()[0]))[1])
    for i, j in ((row, column), (column, row)):
        matrix[i, j] *= 1 + 1e-5
    assert share_at_most(matrix, points) == 0


@needs_shared
@pytest.mark.parametrize("condition", [eliminated, identity_rows])
@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("planar/pyamg_unit_square", "P2"), ("planar/thetis_headland", "P2"), ("planar/pyamg_unit_square", "P3"),
        ("quad/quad_dealii_slide", "Q1"), ("quad/quad_dealii_example", "Q1"), ("quad/quad_dealii_example", "Q2"),
    ],
)  # fmt: skip
def test_third_party(file, name, condition):
    given = np.load(SHARED / "corpus" / f"{file}.npz")
    cells = given["quads" if name.startswith("Q") else "triangles"].astype(np.int64)
    used, cells = np.unique(cells, return_inverse=True)
    mesh = mesh_of(given["points"][used, :2].astype(float), cells.reshape(-1, 4 if name.startswith("Q") else 3))
    matrix, points = condition(mesh, element=ELEMENTS[name])
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.8
