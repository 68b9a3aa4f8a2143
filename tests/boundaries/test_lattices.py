"""Lattices that lost their boundary: finite differences above all."""

import gzip

import numpy as np
import pytest
import scipy.sparse as sp
from pyamg.gallery import diffusion_stencil_2d, poisson, stencil_grid
from scipy.io import mmread
from skfem import Basis, BilinearForm, ElementQuad1, ElementTriP1, MeshQuad, MeshTri
from skfem.helpers import grad
from skfem.models import laplace

from meshes import SHARED, largest_error, needs_shared
from unassemble import ConformingMesh, RecoveryError, recover


def shuffled(matrix, points, seed=0):
    order = np.random.default_rng(seed).permutation(len(points))
    return sp.csr_array(matrix)[order][:, order], points[order]


def grid_points(shape, steps=(1.0, 1.0)):
    return np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 2) * np.array(steps)


@pytest.mark.parametrize("shape", [(3, 3), (3, 9), (5, 5), (20, 30), (40, 31)])
@pytest.mark.parametrize("c", [1.0, -2.5])
def test_finite_differences(shape, c):
    matrix, points = shuffled(c * poisson(shape, format="csr"), grid_points(shape))
    found = recover(matrix)
    assert found.status == "certified", found.reason
    assert found.backward_error <= 1e-12
    assert largest_error(found.points, points) <= 1e-12
    assert found.n_polygons == (shape[0] - 1) * (shape[1] - 1)
    assert not len(found.triangles)
    assert found.scale == pytest.approx(c, rel=1e-12)
    assert not found.node_status.any()
    assert found.uniqueness == "conventional"  # others fit too, bent next to what is gone


def test_the_vertices_that_are_gone():
    matrix, points = shuffled(poisson((6, 9)), grid_points((6, 9)))
    found = recover(matrix)
    rim = grid_points((8, 11)) - 1.0
    rim = rim[(rim < 0).any(axis=1) | (rim[:, 0] > 5) | (rim[:, 1] > 8)]
    a, b = found.points @ [1, 1j], points @ [1, 1j]
    centre = b.mean()
    turns = [
        (np.vdot(one - one.mean(), b - centre) / np.vdot(one - one.mean(), one - one.mean())) for one in (a, a.conj())
    ]
    gone = found.eliminated_points @ [1, 1j]
    fits = [
        turn * (z - one.mean()) + centre for turn, z, one in zip(turns, (gone, gone.conj()), (a, a.conj()), strict=True)
    ]
    distance = min(np.abs(fit[:, None] - rim @ [1, 1j]).min(axis=1).max() for fit in fits)
    assert len(gone) == len(rim)
    assert distance <= 1e-10


@pytest.mark.parametrize("epsilon", [0.01, 0.3, 7.0])
def test_rectangles(epsilon):
    """Squares under -epsilon u_xx - u_yy are rectangles under the Laplacian, of aspect ratio sqrt(epsilon)."""
    stencil = diffusion_stencil_2d(epsilon=epsilon, theta=0.0, type="FD")
    points = grid_points((7, 11), (1 / np.sqrt(stencil[0, 1] / stencil[1, 0]), 1.0))
    matrix, points = shuffled(stencil_grid(stencil, (7, 11)), points)
    found = recover(matrix)
    assert found.certified, found.reason
    assert largest_error(found.points, points) <= 1e-10
    assert abs(found.scale[0]) == pytest.approx(np.sqrt(epsilon), rel=1e-10)


def triangular(shape, basis):
    """Nodes of a lattice of triangles, in a parallelogram; and its matrix, by scikit-fem."""
    at = grid_points(shape).astype(int)
    number = np.arange(len(at)).reshape(shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, d], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])
    points = at @ np.array(basis)
    mesh = Basis(MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(triangles.T)), ElementTriP1())
    edge = (at == 0) | (at == np.array(shape) - 1)
    return sp.csr_array(laplace.assemble(mesh)), points, edge


@pytest.mark.parametrize(
    "basis",
    [((1.0, 0.0), (0.5, np.sqrt(0.75))), ((1.0, 0.0), (0.3, 0.7)), ((1.0, 0.0), (-0.4, 1.3))],
    ids=["equilateral", "acute", "obtuse"],
)
def test_triangles(basis):
    matrix, points, edge = triangular((9, 13), basis)
    inside = ~edge.any(axis=1)
    matrix, points = shuffled(3.0 * matrix[inside][:, inside], points[inside])
    found = recover(matrix)
    assert found.certified, found.reason
    assert largest_error(found.points, points) <= 1e-11
    assert found.scale == pytest.approx(3.0, rel=1e-11)
    assert len(found.triangles) == 2 * 6 * 10


@pytest.mark.parametrize("basis", [((1.0, 0.0), (0.0, 0.6)), ((1.0, 0.0), (0.3, 0.7))], ids=["right", "acute"])
def test_one_side_is_left(basis):
    """Unknowns eliminated on three sides, natural conditions on the fourth."""
    matrix, points, edge = triangular((9, 13), basis)
    inside = ~(edge[:, 0] | (edge[:, 1] & (grid_points((9, 13))[:, 1] > 0)))
    matrix = matrix[inside][:, inside]
    matrix.eliminate_zeros()
    matrix, points = shuffled(matrix, points[inside])
    found = recover(matrix)
    assert found.certified, found.reason
    assert largest_error(found.points, points) <= 1e-11


def test_a_corner_and_a_hole():
    """Rows of an L with a hole, all surrounded by others that were eliminated."""
    at = grid_points((20, 24))
    kept = ~((at[:, 0] > 11) & (at[:, 1] > 13)) & ~((np.abs(at[:, 0] - 6) < 2) & (np.abs(at[:, 1] - 7) < 3))
    matrix, points = shuffled(sp.csr_array(poisson((20, 24), format="csr"))[kept][:, kept], at[kept])
    found = recover(matrix)
    assert found.certified, found.reason
    assert found.n_holes == 1
    assert largest_error(found.points, points) <= 1e-12


def test_a_multiple_of_the_identity():
    matrix, points = shuffled(poisson((12, 9)) + 0.37 * sp.eye_array(108), grid_points((12, 9)))
    found = recover(matrix)
    assert found.certified, found.reason
    assert "0.37 times the identity" in " ".join(found.warnings)
    assert largest_error(found.points, points) <= 1e-12


def test_frames():
    """Anchors place what is gone along with the rest."""
    at = grid_points((4, 7))
    matrix, points = shuffled(poisson((4, 7)), at @ np.array([(2.0, 1.0), (-1.0, 2.0)]))
    anchors = [(k, *points[k]) for k in (0, 5, 17)]
    found = recover(matrix, anchors=anchors)
    assert np.abs(found.points - points).max() <= 1e-10
    assert np.abs(found.eliminated_points - points.mean(axis=0)).max() <= 2 * np.ptp(points)


def test_a_network_is_no_lattice():
    """Equal resistors on a square grid, grounded at one node: the rim has none of the cells beside it."""
    row = poisson((8, 8), format="csr")
    network = row - sp.diags_array(row.sum(axis=1).ravel())
    grounded = sp.csr_array(network + sp.diags_array(np.eye(64)[20]))
    assert not recover(shuffled(grounded, grid_points((8, 8)))[0]).certified


@pytest.mark.parametrize("which", ["entry", "diagonal"])
def test_one_wrong_number(which):
    matrix = sp.lil_array(poisson((9, 9)))
    if which == "entry":
        matrix[40, 41] = matrix[41, 40] = -1.001
    else:
        matrix[40, 40] = 4.001
    try:
        found = recover(shuffled(matrix, grid_points((9, 9)))[0])
    except RecoveryError:
        return
    assert not found.certified


@pytest.mark.parametrize("basis", [((1.0, 0.0), (0.0, 1.0)), ((1.0, 0.0), (0.0, 0.6)), ((1.0, 0.2), (-0.3, 0.7))])
def test_bilinear_elements(basis):
    """Nine-point stars: all rows with their unknowns on the boundary taken out, by scikit-fem."""
    mesh = MeshQuad.init_tensor(np.arange(9.0), np.arange(7.0))
    mesh = MeshQuad(np.array(basis).T @ mesh.p, mesh.t)
    matrix = laplace.assemble(Basis(mesh, ElementQuad1()))
    inside = np.setdiff1d(np.arange(mesh.nvertices), mesh.boundary_nodes())
    matrix, points = shuffled(-2.0 * sp.csr_array(matrix)[inside][:, inside], mesh.p.T[inside])
    found = recover(matrix)
    assert found.certified, found.reason
    assert isinstance(found, ConformingMesh)
    assert found.quads.shape == (6 * 4, 4)
    assert len(found.eliminated_points) == 28
    assert largest_error(found.points, points) <= 1e-11
    assert found.scale == pytest.approx(-2.0, rel=1e-11)


def test_bilinear_elements_of_a_tensor():
    """Nine-point stars of a diffusion that prefers a direction."""
    tensor = np.array([[1.5, 0.3], [0.3, 1.0]])
    mesh = MeshQuad.init_tensor(np.arange(9.0), np.arange(7.0))

    @BilinearForm
    def form(u, v, _):
        return sum(tensor[i, j] * grad(u)[j] * grad(v)[i] for i in range(2) for j in range(2))

    inside = np.setdiff1d(np.arange(mesh.nvertices), mesh.boundary_nodes())
    matrix, points = shuffled(
        sp.csr_array(form.assemble(Basis(mesh, ElementQuad1())))[inside][:, inside], mesh.p.T[inside]
    )
    found = recover(matrix, tensor=(1.5, 0.3, 1.0), anchors=[(k, *points[k]) for k in (0, 5, 17)])
    assert found.certified, found.reason
    assert np.abs(found.points - points).max() <= 1e-10


@needs_shared
def test_the_nine_point_star_of_harwell_boeing():
    with gzip.open(SHARED / "classics" / "gr_30_30.mtx.gz") as stream:
        found = recover(mmread(stream))
    assert found.certified, found.reason
    assert found.quads.shape == (29 * 29, 4)
    assert len(found.eliminated_points) == 124


def test_one_wrong_entry_among_nine_points():
    star = np.array([[-1.0, -1, -1], [-1, 8, -1], [-1, -1, -1]])
    matrix = sp.lil_array(stencil_grid(star, (9, 9)))
    matrix[40, 41] = matrix[41, 40] = -1.001
    try:
        found = recover(matrix)
    except RecoveryError:
        return
    assert not found.certified
