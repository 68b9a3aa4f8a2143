"""What is no surface, or is not known to be one."""

import re

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from skfem.helpers import dot, grad
from surfaces import lattice, sheet, sphere, surface, torus

from meshes import random_mesh, specimen
from unassemble import GeometryError, InputError, RecoveryError, Surface, TopologyError, recover


def solid(mesh, seed=0):
    form = skfem.BilinearForm(lambda u, v, w: dot(grad(u), grad(v)))
    element = {4: skfem.ElementTetP1, 8: skfem.ElementHex1}[mesh.t.shape[0]]
    entries = form.coo_data(skfem.Basis(mesh, element()))
    place = np.random.default_rng(seed).permutation(mesh.p.shape[1])
    row, column = (place[index] for index in entries.indices)
    return sp.coo_array((entries.data, (row, column)), shape=(len(place),) * 2).tocsr()


def shaken(mesh, size, seed=0):
    p = mesh.p + size * np.random.default_rng(seed).uniform(-1, 1, mesh.p.shape)
    return type(mesh)(p, mesh.t)


ONE = skfem.MeshTet(np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0.1, 0, 1.0]]), np.arange(4)[:, None])
TWO = skfem.MeshTet(
    np.array([[0, 1, 0, 0.2, 0.9], [0, 0, 1, 0.1, 0.9], [0, 0.1, 0, 1.0, 0.8]]),
    np.array([[0, 1, 2, 3], [1, 2, 3, 4]]).T,
)
SOLIDS = {
    "tetrahedron": ONE,
    "two tetrahedra": TWO,
    "tetrahedra": shaken(skfem.MeshTet.init_tensor(*3 * [np.linspace(0, 1, 4)]), 0.04),
    "ball": skfem.MeshTet.init_ball(2),
    "hexahedra": shaken(skfem.MeshHex.init_tensor(*3 * [np.linspace(0, 1, 4)]), 0.04),
}


@pytest.mark.parametrize("operator", ["surface", "auto"])
@pytest.mark.parametrize("name", SOLIDS)
def test_solids_are_never_certified_surfaces(name, operator):
    try:
        found = recover(solid(SOLIDS[name]), operator=operator)
    except RecoveryError:
        return
    assert not (isinstance(found, Surface) and found.certified), found.reason


def chain_of_tetrahedra(n, seed=0):
    """Four consecutive points each: its graph is that of a closed surface."""
    k = np.arange(n)
    turn = np.arccos(-2 / 3)
    p = np.stack([np.cos(turn * k), np.sin(turn * k), 0.6 * k]) + np.random.default_rng(seed).uniform(
        -0.05, 0.05, (3, n)
    )
    return skfem.MeshTet(p, np.stack([k[:-3], k[1:-2], k[2:-1], k[3:]]))


def test_chain_of_tetrahedra_is_no_surface():
    with pytest.raises(TopologyError, match=r"lies in \d triangles"):
        recover(solid(chain_of_tetrahedra(12)), operator="surface")
    one = recover(solid(chain_of_tetrahedra(4)), operator="surface")
    assert one.status == "ambiguous"
    assert "tetrahedra fit as well" in one.reason


def test_edges_in_three_triangles_are_named():
    """A fin on a torus; and three sheets that meet in a line."""
    points, triangles = torus()
    fin = np.array([[*triangles[0][:2], len(points)]])
    finned = surface(np.vstack([points, 1.3 * points[triangles[0][:2]].mean(axis=0)]), np.vstack([triangles, fin]))
    k = 6
    page = lattice(k, k, round_k=False, round_m=False)
    i, j = (part.astype(float) for part in np.divmod(np.arange(k * k), k))
    sheets = [np.stack([i, j * np.cos(turn), j * np.sin(turn)], 1) for turn in (0.0, 2.0, 4.0)]
    spine = np.where(np.arange(k * k) % k == 0, np.arange(k * k), -1)
    pages = [np.where(spine[page] < 0, page + sheet * k * k, page) for sheet in range(3)]
    used, pages = np.unique(np.concatenate(pages), return_inverse=True)
    book = surface(np.concatenate(sheets)[used], pages.reshape(-1, 3))
    for known in (finned, book):
        with pytest.raises(TopologyError, match=r"the edge between rows \d+ and \d+ lies in 3 triangles") as caught:
            recover(known.matrix, operator="surface")
        i, j = (int(word) for word in re.findall(r"rows (\d+) and (\d+)", str(caught.value))[0])
        assert np.isin(known.triangles, [i, j]).sum(axis=1).tolist().count(2) == 3


def test_edges_in_no_triangle_are_named():
    k = 9
    path = sp.diags_array([np.full(k - 1, -1.0), np.full(k, 2.0), np.full(k - 1, -1.0)], offsets=[-1, 0, 1])
    with pytest.raises(TopologyError, match="the edge between rows 0 and 1 lies on no cycle"):
        recover(path.tocsr(), operator="surface")


@pytest.mark.parametrize("operator", ["surface", "auto"])
@pytest.mark.parametrize(("gone", "n", "seed"), [(1, 70, 4), (5, 70, 4), ("boundary", 70, 4), ("boundary", 300, 5)])
def test_rows_that_were_taken_out_show(gone, n, seed, operator):
    """What is left of a planar mesh is a surface with other lengths, although some points may be told in the plane."""
    points, triangles = random_mesh(n, seed=seed, holes=False)
    known = specimen(points, triangles, c=1.0)
    rng = np.random.default_rng(0)
    n = len(points)
    if gone == "boundary":
        sides = np.sort(known.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        pairs, count = np.unique(sides, axis=0, return_counts=True)
        keep = np.setdiff1d(np.arange(n), pairs[count == 1])
    else:
        keep = np.sort(rng.permutation(n)[gone:])
    matrix = known.matrix[keep][:, keep]
    try:
        found = recover(matrix, operator=operator)
    except RecoveryError:
        return
    assert not (isinstance(found, Surface) and found.certified), found.reason


def without_a_row(seed):
    """A sphere without a vertex of degree three: the hole is a triangle."""
    points, triangles = sphere(100, seed)
    a, b, c = triangles[7]
    middle = points[[a, b, c]].mean(axis=0) * 1.1
    fan = [[a, b, len(points)], [b, c, len(points)], [c, a, len(points)]]
    known = surface(np.vstack([points, middle]), np.vstack([np.delete(triangles, 7, axis=0), fan]))
    top = int(np.argmin(np.linalg.norm(known.points - middle, axis=1)))
    keep = np.delete(np.arange(len(points) + 1), top)
    return known.matrix[keep][:, keep]


@pytest.mark.parametrize("seed", range(5))
def test_rows_taken_out_of_a_surface_show_though_the_hole_is_closed(seed):
    try:
        found = recover(without_a_row(seed), operator="surface")
    except GeometryError:
        return
    assert found.status == "uncertified", found.reason


def test_wrong_entry_shows_in_the_row_sums():
    known = surface(*torus())
    matrix = known.matrix.tolil()
    i, j = known.triangles[3][:2]
    matrix[i, j] = matrix[j, i] = 1.2 * matrix[i, j]
    found = recover(matrix.tocsr(), operator="surface")
    assert found.status == "uncertified"
    assert "do not sum to zero" in found.reason


def test_weights_of_no_metric():
    """What is left next to a row that was taken out."""
    known = without_a_row(2)
    with pytest.raises(GeometryError, match="no edge lengths were found"):
        recover(known, operator="surface")


@pytest.mark.parametrize(
    "options",
    [{"tensor": (2, 0, 1), "direction": (0, 1, 0.0), "handed": "left"}, {"anchors": [(0, 0, 0)]}],
)
def test_options_of_planar_meshes(options):
    with pytest.raises(InputError, match="surface"):
        recover(surface(*sheet()).matrix, operator="surface", **options)


def test_nodes_are_not_for_surfaces():
    with pytest.raises(InputError, match="vector-valued"):
        recover(surface(*sheet()).matrix, operator="surface", block_size=3)


def test_diagonal_matrix():
    with pytest.raises(RecoveryError):
        recover(sp.eye_array(5).tocsr(), operator="surface")


def test_errors_that_keep_row_sums_are_no_bending():
    """Without the operator given a flat mesh whose entries are a little off stays one."""
    known = specimen(*random_mesh(150, seed=2))
    upper = sp.triu(known.matrix, 1).tocoo()
    upper.data = upper.data + 1e-4 * np.random.default_rng(0).standard_normal(upper.nnz)
    matrix = (upper + upper.T).tocsr()
    matrix = (matrix - sp.diags_array(matrix.sum(axis=1))).tocsr()
    found = recover(matrix)
    assert not isinstance(found, Surface)
    assert found.status == "uncertified"
    assert any("operator='surface'" in note for note in found.warnings)
    assert recover(matrix, operator="surface").certified  # as what it is said to be
