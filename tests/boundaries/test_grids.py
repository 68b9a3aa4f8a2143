"""Grids of parallelograms with Dirichlet conditions of every kind; scikit-fem assembles."""

from contextlib import suppress

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import Basis, ElementQuad1, ElementTriP1, MeshQuad, MeshTri, asm, enforce
from skfem.models import laplace, mass

from meshes import largest_error
from unassemble import ConformingMesh, RecoveryError, recover

UNIFORM = np.arange(9.0), 0.7 * np.arange(8.0)
ELEMENTS = pytest.mark.parametrize("element", ["P1", "Q1"])


def assembled(element, lines, shear=0.0):
    """A stiffness matrix with some c, and points."""
    kind, functions = (MeshTri, ElementTriP1()) if element == "P1" else (MeshQuad, ElementQuad1())
    mesh = kind.init_tensor(*lines)
    basis = Basis(kind(np.array([(1, shear), (0, 1)]) @ mesh.p, mesh.t), functions)
    return 3.7 * sp.csr_array(asm(laplace, basis)), basis.mesh


def shuffled(matrix, points, seed=1):
    order = np.random.default_rng(seed).permutation(len(points))
    return sp.csr_array(matrix)[order][:, order], points[order]


def check(matrix, points, *, known, plausible=0):
    """Certified, with so many rows determined, and all of them right."""
    matrix, points = shuffled(matrix, points)
    found = recover(matrix)
    assert found.certified, found.reason
    right = found.node_status == 0
    assert right.sum() == known
    assert (found.node_status == 2).sum() == plausible
    assert largest_error(found.points[right], points[right]) <= 1e-11
    assert found.scale == pytest.approx(3.7, rel=1e-11)
    assert found.uniqueness == "conventional"
    assert "the only mesh of parallelograms that are all alike" in " ".join(found.warnings)
    return found


@ELEMENTS
def test_eliminated(element):
    matrix, mesh = assembled(element, UNIFORM)
    inside = mesh.interior_nodes()
    found = check(matrix[inside][:, inside], mesh.p.T[inside], known=len(inside))
    assert isinstance(found, ConformingMesh) == (element == "Q1")
    assert len(found.eliminated_points) == len(mesh.boundary_nodes())


@ELEMENTS
@pytest.mark.parametrize("seed", range(3))  # any direction of the triangles may come first
@pytest.mark.parametrize("shear", [0.4, -1.1])
def test_sheared(element, seed, shear):
    matrix, mesh = assembled(element, UNIFORM, shear)
    inside = mesh.interior_nodes()
    points = mesh.p.T[inside]
    check(*shuffled(matrix[inside][:, inside], points, seed), known=len(inside))


@ELEMENTS
def test_on_one_side(element):
    matrix, mesh = assembled(element, UNIFORM)
    kept = np.flatnonzero(mesh.p[0] > 0)
    check(matrix[kept][:, kept], mesh.p.T[kept], known=len(kept))


@ELEMENTS
def test_identity_rows(element):
    """Zeros that stay stored between replaced rows show where corners are."""
    matrix, mesh = assembled(element, UNIFORM)
    matrix = enforce(sp.csr_matrix(matrix), D=mesh.boundary_nodes())
    found = check(matrix, mesh.p.T, known=mesh.nvertices)
    assert not len(found.eliminated_points)


@ELEMENTS
def test_identity_rows_without_zeros(element):
    """Corners of right triangles are in no other row then, and of equal squares two rows beside each change places."""
    matrix, mesh = assembled(element, (UNIFORM[0], UNIFORM[0]))
    matrix = enforce(sp.csr_matrix(matrix), D=mesh.boundary_nodes())
    matrix.eliminate_zeros()
    corners = 4 if element == "P1" else 0
    plausible = 8 if element == "P1" else 0
    found = check(matrix, mesh.p.T, known=mesh.nvertices - corners - plausible, plausible=plausible)
    assert len(found.eliminated_points) == corners


@ELEMENTS
def test_identity_rows_on_one_side(element):
    matrix, mesh = assembled(element, UNIFORM)
    matrix = enforce(sp.csr_matrix(matrix), D=np.flatnonzero(mesh.p[0] == 0))
    check(matrix, mesh.p.T, known=mesh.nvertices)


@ELEMENTS
def test_rows_and_columns_of_the_identity(element):
    matrix, mesh = assembled(element, UNIFORM)
    inside = mesh.interior_nodes()
    free = sp.diags_array(np.isin(np.arange(mesh.nvertices), inside).astype(float))
    matrix = sp.csr_array(free @ matrix @ free + sp.eye_array(mesh.nvertices) - free)
    matrix.eliminate_zeros()
    found = check(matrix, mesh.p.T, known=len(inside))
    assert np.isnan(found.points[found.node_status == 1]).all()


@pytest.mark.parametrize("density", [0.04, 30.0])
def test_a_lumped_mass_matrix_added(density):
    """Implicit Euler steps of the heat equation by finite volumes."""
    matrix, mesh = assembled("P1", UNIFORM)
    inside = mesh.interior_nodes()
    added = density * 0.7 * sp.eye_array(len(inside))
    found = check(matrix[inside][:, inside] + added, mesh.p.T[inside], known=len(inside))
    assert "times the identity was added" in " ".join(found.warnings)


def test_a_consistent_mass_matrix_added():
    """On triangles that are all alike it is that of another lattice, and a multiple of the identity."""
    _, mesh = assembled("P1", UNIFORM)
    basis = Basis(mesh, ElementTriP1())
    inside = mesh.interior_nodes()
    matrix = sp.csr_array(asm(laplace, basis) + 0.1 * asm(mass, basis))
    found = recover(shuffled(matrix[inside][:, inside], mesh.p.T[inside])[0])
    assert (found.status, found.uniqueness) == ("ambiguous", "ambiguous")
    assert "with a consistent mass matrix in its place triangles of other shapes" in " ".join(found.warnings)


def test_a_step_and_a_hole():
    """Unknowns eliminated all around a domain that is no rectangle."""
    matrix, mesh = assembled("Q1", (np.arange(19.0), 0.7 * np.arange(10)))
    i, j = (np.searchsorted(line, at) for line, at in zip(map(np.unique, mesh.p), mesh.p, strict=True))
    kept = np.isin(np.arange(mesh.nvertices), mesh.interior_nodes()) & ~((i > 11) & (j > 5)) & ~((i == 5) & (j == 4))
    found = check(matrix[kept][:, kept], mesh.p.T[kept], known=int(kept.sum()))
    assert found.n_holes == 1


def test_slender_cells():
    """Cells 10,000 times as long as they are high."""
    matrix, mesh = assembled("P1", (np.arange(12.0), 1e-4 * np.arange(12)))
    inside = mesh.interior_nodes()
    check(matrix[inside][:, inside], mesh.p.T[inside], known=len(inside))


@ELEMENTS
@pytest.mark.parametrize("which", ["entry", "diagonal", "column"])
def test_one_wrong_number(element, which):
    matrix, mesh = assembled(element, UNIFORM)
    held = np.isin(np.arange(mesh.nvertices), mesh.boundary_nodes())
    matrix = sp.lil_array(enforce(sp.csr_matrix(matrix), D=np.flatnonzero(held)))
    inside = np.flatnonzero(~held)
    neighbours = np.array(matrix.rows[inside[30]])
    if which == "diagonal":
        matrix[inside[30], inside[30]] *= 1 + 1e-6
    elif which == "entry":
        other = neighbours[~held[neighbours] & (neighbours != inside[30])][0]
        matrix[inside[30], other] = matrix[other, inside[30]] = matrix[other, inside[30]] * (1 + 1e-6)
    else:
        row = next(row for row in inside.tolist() if held[matrix.rows[row]].any())
        matrix[row, next(other for other in matrix.rows[row] if held[other])] *= 1 + 1e-6
    try:
        found = recover(shuffled(matrix, mesh.p.T)[0])
    except RecoveryError:
        return
    assert not found.certified


@pytest.mark.parametrize("element", ["P1", "Q1"])
@pytest.mark.parametrize("factor", [-1.0, 1e10, -1e10])
def test_entries_of_no_rectangles(element, factor):
    """Of other signs or sizes along every second line, or the first one: no warning, and no grid."""
    matrix, mesh = assembled(element, UNIFORM)
    inside = mesh.interior_nodes()
    x, y = mesh.p[:, inside]
    matrix = sp.coo_array(matrix[inside][:, inside])
    row, column = matrix.coords
    along = (x[row] == x[column]) & (row != column)
    some = along & (np.rint(np.minimum(y[row], y[column]) / 0.7) % 2 == 0) if factor == -1.0 else along & (x[row] == 1)
    changed = sp.csr_array((np.where(some, factor * matrix.data, matrix.data), (row, column)), shape=matrix.shape)
    with suppress(RecoveryError):
        assert not recover(changed).certified
