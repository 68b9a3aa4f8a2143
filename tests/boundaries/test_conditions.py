"""Meshes whose matrices have boundary conditions in them: what is determined is right, and it is most of it."""

import numpy as np
import pyamg
import pytest
import scipy.sparse as sp
from conditions import convected, determined, eliminated, identity_rows, jittered, mesh_of, robin, shuffled
from scipy.spatial import Delaunay
from skfem import Basis, BilinearForm, ElementTriP1, MeshTri
from skfem.helpers import dot, grad
from skfem.models import laplace

from meshes import SHARED, largest_error, needs_shared, random_mesh
from unassemble import RecoveryError, recover
from unassemble.certificate import certify_with_boundary_terms
from unassemble.matrix import check_matrix


def corpus(name):
    mesh = np.load(SHARED / "corpus" / "planar" / f"{name}.npz")
    return mesh_of(mesh["points"][:, :2].astype(float), mesh["triangles"].astype(np.int64))


def test_the_airfoil_of_pyamg():
    """260 rows of 322: the boundary was eliminated before it was stored."""
    example = pyamg.gallery.load_example("airfoil")
    triangles = example["elements"] - example["elements"].min()
    boundary = mesh_of(example["vertices"], triangles).boundary_nodes()
    inside = np.setdiff1d(np.arange(len(example["vertices"])), boundary)
    found = recover(example["A"])
    known = found.node_status == 0
    assert found.certified, found.reason
    assert known.sum() >= 250
    assert largest_error(found.points[known], example["vertices"][inside][known]) <= 1e-10


@pytest.mark.parametrize("seed", range(3))
def test_eliminated(seed):
    matrix, points = eliminated(mesh_of(*random_mesh(600, seed=seed, holes=False)))
    found = recover(-2.5 * matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.8  # there are slivers at the rim
    assert found.scale == pytest.approx(-2.5, rel=1e-9)
    assert set(found.node_status.tolist()) <= {0, 1, 2}


@needs_shared
@pytest.mark.parametrize("name", ["pyamg_unit_square", "thetis_headland", "skfem_ex28", "meshpart_Eppstein"])
def test_eliminated_third_party(name):
    matrix, points = eliminated(corpus(name))
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.7


@pytest.mark.slow
@needs_shared
@pytest.mark.parametrize("name", ["airfoil_matlab", "airfoil2_barth"])
def test_edges_of_very_different_lengths(name):
    """Positions that fit entries are found by way of lengths only."""
    matrix, points = identity_rows(corpus(name), -0.7)
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.99
    assert found.scale == pytest.approx(-0.7, rel=1e-9)


def test_eliminated_in_part():
    """Natural conditions on one side: entries there are those of a boundary, and count."""
    matrix, points = eliminated(jittered(seed=1), lambda x: x[0] < 0.7)
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.9


def test_eliminated_about_holes_that_meet():
    """Two holes with a vertex in common make one loop, which comes to that vertex twice."""
    mesh = jittered(seed=4)
    x, y = mesh.p[:, mesh.t].mean(axis=1)
    mesh = mesh.remove_elements(
        np.flatnonzero((np.maximum(np.abs(x - 0.5), np.abs(y - 0.5)) < 0.25) & ((x > 0.5) == (y > 0.5)))
    )
    matrix, points = eliminated(mesh, lambda p: (np.abs(p - 0.5) > 0.49).any(axis=0))
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.8


@pytest.mark.parametrize("c", [1.0, -3.0])
def test_identity_rows(c):
    matrix, points = identity_rows(jittered(seed=2), c)
    found = recover(matrix)
    assert found.certified, found.reason
    assert "boundary condition" in " ".join(found.warnings)
    assert determined(found, points) >= 0.9
    assert found.scale == pytest.approx(c, rel=1e-9)


def test_identity_rows_without_their_zeros():
    """Edges between boundary vertices are not in the matrix then."""
    matrix, points = identity_rows(jittered(seed=6))
    matrix.eliminate_zeros()
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.9


@pytest.mark.parametrize("levels", [3, 4])
def test_identity_rows_of_a_disc(levels):
    """Some cells are rectangles, on whose diagonals nothing is stored."""
    matrix, points = identity_rows(MeshTri.init_circle(levels))
    matrix.eliminate_zeros()
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) == 1
    assert "on one circle" in " ".join(found.warnings)


@needs_shared
@pytest.mark.parametrize(
    "name", ["pyamg_airfoil", "skfem_annulus", pytest.param("gc_lego", marks=pytest.mark.slow), "skfem_square"]
)
def test_identity_rows_third_party(name):
    matrix, points = identity_rows(corpus(name))
    found = recover(matrix)
    assert found.certified, found.reason
    assert determined(found, points) >= (0.8 if name == "pyamg_airfoil" else 0.9)


def annulus(n=24, seed=0):
    """Rings of triangles: two loops of evenly many edges, and hardly an entry that is whole."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(-0.2, 0.2, (3, n))) / n
    radius = np.array([[1.0], [1.3], [1.7]]) + rng.uniform(-0.05, 0.05, (3, n))
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1).reshape(-1, 2)
    a = np.arange(2 * n).reshape(2, n)
    b, c, d = np.roll(a, -1, axis=1), a + n, np.roll(a, -1, axis=1) + n
    return mesh_of(points, np.stack([a, c, b, b, c, d], -1).reshape(-1, 3))


MESHES = {
    "odd loop": lambda: mesh_of(*random_mesh(150, seed=3, holes=False)),
    "even loop": lambda: jittered(seed=3),
    "even loops, all narrow": annulus,
}


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("alpha", [1e-3, 1.0, 100.0])
def test_robin(mesh, alpha):
    """Row sums say what the boundary has: all points come back."""
    matrix, points = robin(MESHES[mesh](), alpha)
    found = recover(-0.3 * matrix)
    assert found.certified, found.reason
    assert determined(found, points) == 1
    assert "was taken off" in " ".join(found.warnings)
    assert found.scale == pytest.approx(-0.3, rel=1e-9)


@pytest.mark.parametrize("term", ["Robin", "flow"])
def test_the_matrix_with_its_terms_is_what_is_given_back(term):
    """All its entries and its diagonal are compared, not those of the Laplacian that was found in it."""
    mesh = annulus()
    matrix, _ = robin(mesh, 3.0) if term == "Robin" else convected(mesh, (3.0, -1.0))
    matrix = sp.csr_array((matrix + matrix.T) / 2)
    found = recover(matrix)
    assert found.certified, found.reason
    assert "with the terms on its boundary" in found.reason
    assert found.uniqueness == "searched"
    assert found.n_fitting == found.n_entries == sp.triu(matrix).nnz
    again = certify_with_boundary_terms(check_matrix(matrix), found)
    assert again.backward_error == found.backward_error <= 1e-9
    assert again.spare > 0


@pytest.mark.parametrize("place", ["side", "row of the boundary", "row inside", "term of one side"])
def test_a_wrong_entry_is_not_explained_by_terms(place):
    """The factors of the certificate are too few to follow it."""
    mesh = jittered(seed=3)
    matrix, _ = robin(mesh, 3.0)
    found = recover(matrix)
    a, b = found.boundary[0]
    inside = np.setdiff1d(np.arange(matrix.shape[0]), found.boundary)[0]
    wrong = sp.lil_array(matrix)
    if place == "row inside":
        wrong[inside, inside] += 1e-6
    elif place == "row of the boundary":
        wrong[a, a] += 1e-6
    else:
        wrong[a, b] += 1e-6
        wrong[b, a] += 1e-6
    if place == "term of one side":  # a term of this edge alone
        wrong[a, a] += 2e-6
        wrong[b, b] += 2e-6
    error = certify_with_boundary_terms(check_matrix(sp.csr_array(wrong)), found).backward_error
    assert 1e-8 < error < 1e-4


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("field", [(1.0, 0.0), (-20.0, 30.0)])
def test_the_symmetric_part_of_convection(mesh, field):
    """With a constant field C + C' is a boundary integral: entries inside are those of the Laplacian."""
    matrix, points = convected(MESHES[mesh](), field)
    found = recover((matrix + matrix.T) / 2)
    assert found.certified, found.reason
    assert determined(found, points) >= 0.85


@needs_shared
def test_a_rail_with_robin_terms():
    """Of E it has the areas, another integral over the same mesh; S has the same points in another mesh of the rail."""
    A, E, S = (recover(SHARED / "classics" / f"rail_371_{name}.mtx.gz") for name in "AES")
    known = A.node_status == 0
    assert A.certified
    assert known.sum() == 366
    areas = {frozenset(triangle): area for triangle, area in zip(E.triangles.tolist(), E.areas, strict=True)}
    inside = A.triangles[known[A.triangles].all(axis=1)]
    assert len(inside) >= 600
    p, q, r = (A.points @ [1, 1j])[inside].T
    ratio = (np.conj(q - p) * (r - p)).imag / [areas[frozenset(triangle)] for triangle in inside.tolist()]
    assert np.ptp(ratio) <= 1e-11 * ratio.mean()
    coarse = known & (np.arange(len(known)) < 100)  # both meshes refine one, whose vertices come first
    a, s = (found.points @ [1, 1j] for found in (A, S))
    factor, shift = np.linalg.lstsq(np.column_stack([a, np.ones(len(a))])[coarse], s[coarse])[0]
    distance = np.abs((factor * a + shift)[known, None] - s)
    assert len(np.unique(distance.argmin(axis=1))) == 366
    assert np.median(distance.min(axis=1)) <= 1e-6 * np.ptp(S.points)
    assert distance.min(axis=1).max() <= 1e-4 * np.ptp(S.points)


def test_robin_terms_of_another_factor_on_each_edge():
    """No Robin condition: row sums give terms, but not those of the mesh."""
    mesh = jittered(seed=5)
    matrix, points = robin(mesh, 0.0)
    rng, more = np.random.default_rng(0), sp.lil_array(matrix.shape)
    place = {tuple(x): k for k, x in enumerate(points.tolist())}
    for ends in mesh.facets[:, mesh.boundary_facets()].T:
        rows, factor = [place[tuple(mesh.p[:, v].tolist())] for v in ends], rng.uniform(0.5, 2)
        more[np.ix_(rows, rows)] += factor * np.array([[2, 1], [1, 2]])
    found = recover(sp.csr_array(matrix + more))
    if found.certified:
        assert "was taken off" not in " ".join(found.warnings)
        determined(found, points)


@pytest.mark.parametrize("noise", [1e-6, 1e-3])
def test_noise_is_not_certified(noise):
    matrix, _ = eliminated(mesh_of(*random_mesh(120, seed=4, holes=False)))
    upper = sp.triu(matrix, 1).tocsr()
    upper.data *= 1 + noise * np.random.default_rng(0).standard_normal(len(upper.data))
    found = recover(upper + upper.T + sp.diags_array(matrix.diagonal()))
    assert not found.certified


def test_a_whole_mesh_stays_one():
    """A diagonal matrix on the boundary is no elimination."""
    mesh = mesh_of(*random_mesh(400, seed=5))
    matrix, points = robin(mesh, 0.0)
    boundary = np.zeros(len(points))
    boundary[np.flatnonzero(np.isin(points[:, 0], mesh.p[0, mesh.boundary_nodes()]))] = 3.0
    found = recover(matrix + sp.diags_array(boundary))
    assert found.certified
    assert found.uniqueness == "proved"
    assert not found.node_status.any()


def test_a_random_rim_is_refused():
    """Entries inside that are not those of any mesh: nothing is called determined."""
    matrix, _ = eliminated(mesh_of(*random_mesh(120, seed=6, holes=False)))
    upper = sp.triu(matrix, 1).tocsr()
    upper.data *= np.random.default_rng(0).uniform(0.8, 1.2, len(upper.data))
    assert not recover(upper + upper.T + sp.diags_array(matrix.diagonal())).certified


def test_shuffled_keeps_zeros():
    matrix, _ = identity_rows(mesh_of(*random_mesh(100, seed=7)))
    assert (matrix.data == 0).any()
    assert shuffled(matrix, np.zeros((matrix.shape[0], 2)))[0].nnz == matrix.nnz


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_slivers_at_the_rim(seed):
    """What is called determined is right, whatever the rim is like."""
    rng = np.random.default_rng(seed)
    mesh = MeshTri(*skewed(rng))
    for matrix, points in (eliminated(mesh), identity_rows(mesh), robin(mesh, 5.0)):
        try:
            found = recover(matrix)
        except RecoveryError:
            continue
        if found.certified:
            determined(found, points)


def skewed(rng):
    """Points in no order, drawn out by a thousand near the rim."""
    points = rng.uniform(size=(150, 2))
    points[:, 0] = np.where(points[:, 0] < 0.1, 1e-3 * points[:, 0], points[:, 0])
    return np.ascontiguousarray(points.T), np.ascontiguousarray(Delaunay(points).simplices.T)


def test_a_wrong_interface():
    """Two materials are no boundary condition: nothing of a mesh of one factor is certified beyond what is right."""
    mesh = jittered(seed=8)
    factor = np.where(mesh.p[0, mesh.t].mean(axis=0) < 0.5, 1.0, 3.0)

    @BilinearForm
    def form(u, v, w):
        return factor[:, None] * dot(grad(u), grad(v))

    matrix = sp.csr_array(form.assemble(Basis(mesh, ElementTriP1())))
    inside = np.setdiff1d(np.arange(mesh.nvertices), mesh.boundary_nodes())
    for some in (np.arange(mesh.nvertices), inside):
        found = recover(matrix[some][:, some])
        if found.certified:
            determined(found, mesh.p.T[some])
    for region in (1.0, 3.0):
        some = np.setdiff1d(np.arange(mesh.nvertices), mesh.t[:, factor != region])
        found = recover(matrix[some][:, some])
        assert found.certified, found.reason
        assert found.scale == pytest.approx(region, rel=1e-9)
        assert determined(found, mesh.p.T[some]) >= 0.9


def test_a_surface_with_rows_taken_out():
    """Entries of a bent sheet belong to no mesh in the plane."""
    mesh = jittered(seed=9)
    x, y = mesh.p
    bent = np.stack([x, y, 0.5 * np.sin(3 * x) * np.cos(2 * y)])
    matrix = cotangents(bent, mesh.t)
    inside = np.setdiff1d(np.arange(mesh.nvertices), mesh.boundary_nodes())
    try:
        found = recover(matrix[inside][:, inside], operator="laplacian")
    except RecoveryError:
        return
    assert not found.certified


def cotangents(points, triangles):
    """The matrix of linear elements on a surface in space, by scikit-fem: each triangle laid flat."""
    a, b, c = points[:, triangles].transpose(1, 0, 2)
    along = np.linalg.norm(b - a, axis=0)
    x = ((c - a) * (b - a)).sum(axis=0) / along
    y = np.sqrt(((c - a) ** 2).sum(axis=0) - x**2)
    zero = np.zeros_like(x)
    flat = MeshTri(
        np.stack([[zero, along, x], [zero, zero, y]]).transpose(0, 2, 1).reshape(2, -1),
        np.arange(3 * len(x)).reshape(-1, 3).T,
    )
    apart = sp.coo_array(laplace.assemble(Basis(flat, ElementTriP1())))
    rows = triangles.T.ravel()
    n = points.shape[1]
    return sp.coo_array((apart.data, (rows[apart.row], rows[apart.col])), shape=(n, n)).tocsr()
