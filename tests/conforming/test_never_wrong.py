"""Matrices that are nearly those of a mesh of other elements, or not at all: never certified."""

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementQuad1, ElementQuadS2, ElementVector, MeshQuad, MeshQuad2, MeshTri
from skfem.helpers import ddot, sym_grad, trace

from conforming.assembled import assembled, cell_sets, laplace, largest_error, quadrilaterals
from meshes import random_mesh
from unassemble import RecoveryError, recover


def status(matrix, **options):
    try:
        return recover(matrix, **options).status
    except RecoveryError:
        return "failed"


def triangles(n=200, seed=0):
    points, cells = random_mesh(n, seed)
    return MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))


@pytest.mark.parametrize("relative", [1e-1, 1e-4, 1e-7])
@pytest.mark.parametrize("element", ["P2", "Q1", "Q2"])
def test_one_entry_changed(element, relative):
    known = assembled(element, triangles() if element == "P2" else quadrilaterals(8, 7))
    assert status(known.matrix) == "certified"
    for seed in range(3):
        entries = known.matrix.tocoo()
        upper = np.flatnonzero((entries.row < entries.col) & (np.abs(entries.data) > 0.1))
        k = np.random.default_rng(seed).choice(upper)
        i, j = int(entries.row[k]), int(entries.col[k])
        changed = known.matrix.tolil()
        changed[i, j] = changed[j, i] = known.matrix[i, j] * (1 + relative)
        assert status(changed.tocsr()) != "certified"


@pytest.mark.parametrize("corners", [(0, 1, 3, 2), (0, 3, 2, 1)])
def test_a_cell_turned_over(corners):
    mesh = quadrilaterals(7, 6)
    cells = mesh.t.copy()
    cells[:, 17] = cells[list(corners), 17]
    crossed = MeshQuad(mesh.p, cells, validate=False, sort_t=False)
    matrix = assembled("Q1", crossed).matrix
    found = status(matrix)
    assert (found == "certified") == (corners == (0, 3, 2, 1))  # the same cell seen from the other side has one matrix


def test_a_vertex_beyond_the_side_across():
    mesh = quadrilaterals(7, 6, shaken=0.1)
    points = mesh.p.copy()
    inside = np.argmin(np.abs(points - [[3.0], [3.0]]).sum(axis=0))
    points[:, inside] += 1.4
    assert status(assembled("Q1", MeshQuad(points, mesh.t)).matrix) != "certified"


def lattice(k: int, side: float, diagonal: float) -> sp.csr_array:
    """Cells of a lattice that each add the same entries."""
    mesh = MeshQuad.init_tensor(np.arange(k + 1.0), np.arange(k + 1.0))
    local = np.full((4, 4), -side)
    local[[0, 2, 1, 3], [2, 0, 3, 1]] = -diagonal
    local[range(4), range(4)] = 2 * side + diagonal
    row, column = (
        np.broadcast_to(mesh.t.T[:, :, None], (k * k, 4, 4)),
        np.broadcast_to(mesh.t.T[:, None], (k * k, 4, 4)),
    )
    value = np.broadcast_to(local, row.shape)
    return sp.coo_array((value.ravel(), (row.ravel(), column.ravel()))).tocsr()


@pytest.mark.parametrize(("side", "diagonal"), [(1.0, 1.0), (1 / 3, 1 / 12), (1.0, 0.2), (0.1, 1.0), (1.0, -0.1)])
def test_nine_points_that_are_no_bilinear_element(side, diagonal):
    assert status(lattice(9, side, diagonal)) != "certified"


def test_nine_points_that_are_one():
    assert status(lattice(9, 1 / 6, 1 / 3)) == "certified"


def test_graph_laplacian_of_a_quadrilateral_mesh():
    cells = quadrilaterals(9, 8).t.T
    edges = np.unique(np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], -1).reshape(-1, 2), axis=1), axis=0)
    n = cells.max() + 1
    half = sp.coo_array((-np.ones(len(edges)), edges.T), shape=(n, n))
    matrix = (half + half.T).tocsr()
    assert status(matrix - sp.diags_array(matrix.sum(axis=1))) != "certified"


@pytest.mark.parametrize("element", ["Q1", "P2", "P3", "S2"])
def test_random_entries_on_the_graph_of_a_mesh(element):
    known = assembled(element, triangles() if element[0] == "P" else quadrilaterals(6, 6)).matrix
    upper = sp.triu(known, 1).tocoo()
    upper.data = -np.random.default_rng(0).uniform(0.5, 1.5, len(upper.data))
    matrix = (upper + upper.T).tocsr()
    assert status(matrix - sp.diags_array(matrix.sum(axis=1))) != "certified"


def test_one_point_quadrature_does_not_determine_the_mesh():
    rule = np.full((2, 1), 0.5), np.ones(1)
    matrix = laplace.assemble(Basis(quadrilaterals(6, 7), ElementQuad1(), quadrature=rule))
    assert status(matrix) != "certified"


def test_traces_of_an_elasticity_matrix():
    """They are (lambda + 3 mu) times a Laplacian: what is certified is that mesh."""
    mesh = quadrilaterals(7, 8)
    basis = Basis(mesh, ElementVector(ElementQuad1()))

    @BilinearForm
    def elastic(u, v, w):
        return 1.3 * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * 0.7 * ddot(sym_grad(u), sym_grad(v))

    whole = elastic.assemble(basis).tocsr()
    matrix = sp.csr_array(whole[::2, ::2] + whole[1::2, 1::2])
    found = recover(matrix)
    assert found.status == "certified"
    assert found.scale == pytest.approx(1.3 + 3 * 0.7)
    assert largest_error(found.points, mesh.p.T) < 1e-12
    assert cell_sets(found) == {frozenset(cell) for cell in mesh.t.T.tolist()}


def test_elasticity_is_no_scalar_matrix():
    basis = Basis(quadrilaterals(7, 8), ElementVector(ElementQuad1()))

    @BilinearForm
    def elastic(u, v, w):
        return 1.3 * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * 0.7 * ddot(sym_grad(u), sym_grad(v))

    matrix = elastic.assemble(basis).tocsr()
    assert recover(matrix).operator == "elasticity"
    assert status(matrix, operator="laplacian") != "certified"


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_few_curved_cells_integrated_by_a_short_rule_leave_nodes_free(seed):
    """Two points of Gauss each way give eight independent numbers for a cell of eight nodes, and 28 entries."""
    rng = np.random.default_rng(seed)
    flat = MeshQuad.init_tensor(np.linspace(0, 1, 3), np.linspace(0, 1, 2 + seed % 2))
    flat = MeshQuad(flat.p + 0.1 * rng.uniform(-1, 1, flat.p.shape), flat.t)
    curved = MeshQuad2.from_mesh(flat)
    points, sides = curved.doflocs.copy(), slice(flat.nvertices, flat.nvertices + flat.nfacets)
    points[:, sides] += 0.05 * rng.uniform(-1, 1, points[:, sides].shape)
    cells = curved.dofs.element_dofs
    points[:, cells[8]] = -0.25 * points[:, cells[:4]].sum(axis=1) + 0.5 * points[:, cells[4:8]].sum(axis=1)
    basis = Basis(MeshQuad2(points, curved.t), ElementQuadS2(), intorder=3)
    matrix, order = laplace.assemble(basis), rng.permutation(basis.N)
    assert status(sp.csr_array(matrix)[order][:, order]) != "certified"
