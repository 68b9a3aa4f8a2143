"""c L + s M from scikit-fem, rows permuted at random: the mesh, its size, and both factors."""

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementTriP1, MeshTri
from skfem.helpers import dot, grad

from meshes import delaunay, largest_error, random_mesh, triangle_set
from unassemble import recover


def assembled(points, triangles, c, s, *, lumped=False, seed=0):
    """The matrix in random row order, and points and triangles in that order."""
    basis = Basis(MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(triangles.T)), ElementTriP1())
    n = len(points)
    forms = [
        BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).coo_data(basis),
        BilinearForm(lambda u, v, w: u * v).coo_data(basis),
    ]
    stiffness, mass = (sp.coo_array((form.data, tuple(form.indices)), shape=(n, n)).tocsr() for form in forms)
    if lumped:
        mass = sp.diags_array(np.asarray(mass.sum(axis=1)).ravel())
    place = np.random.default_rng(seed).permutation(n)
    whole = (c * stiffness + s * mass).tocoo()
    row, column = (place[index] for index in whole.coords)
    return sp.coo_array((whole.data, (row, column)), shape=(n, n)), points[np.argsort(place)], place[triangles]


def areas(points, triangles):
    a, b, c = points[triangles].transpose(1, 2, 0)
    (ux, uy), (wx, wy) = b - a, c - a
    return np.abs(ux * wy - uy * wx) / 2


@pytest.mark.parametrize("lumped", [False, True])
@pytest.mark.parametrize("ratio", [1e-3, 1.0, 100.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_mesh_and_factors(ratio, lumped, sign):
    points, triangles = random_mesh(400, seed=1)
    c, s = sign * 2.5, sign * 2.5 * ratio / (2 * areas(points, triangles).mean())
    matrix, true, cells = assembled(points, triangles, c, s, lumped=lumped)
    found = recover(matrix)
    assert found.status == "certified"
    assert found.backward_error < 1e-11
    assert triangle_set(found.triangles) == triangle_set(cells)
    assert largest_error(found.points, true) < 1e-9
    assert found.scale[0] == pytest.approx(c, rel=1e-9)
    size = areas(found.points, found.triangles).sum() / areas(points, triangles).sum()
    assert found.reaction == pytest.approx(s / size, rel=1e-9)
    assert any("the mesh has a size" in warning for warning in found.warnings)


def test_anchors_fix_the_size_and_so_the_factor():
    points, triangles = random_mesh(200, seed=3)
    matrix, true, _ = assembled(points, triangles, 1.0, 300.0)
    found = recover(matrix, anchors=[(row, *true[row]) for row in (0, 17, 60)])
    assert found.certified
    assert np.abs(found.points - true).max() < 1e-9
    assert found.reaction == pytest.approx(300.0, rel=1e-9)


def test_helmholtz():
    """K - k^2 M, both factors of opposite sign."""
    points, triangles = random_mesh(300, seed=5)
    matrix, true, _ = assembled(points, triangles, 1.0, -400.0)
    found = recover(matrix)
    assert found.certified
    assert largest_error(found.points, true) < 1e-9
    assert found.reaction / found.scale[0] < 0


def test_a_wrong_entry_is_no_certificate():
    points, triangles = delaunay(np.random.default_rng(2).uniform(size=(60, 2)))
    matrix, _, _ = assembled(points, triangles, 1.0, 30.0)
    dense = matrix.toarray()
    i, j = np.argwhere(np.triu(dense, 1))[40]
    for pair in ((i, j), (j, i)):
        dense[pair] *= 1 + 1e-5
    found = recover(dense)
    assert found.status != "certified"


def test_any_other_diagonal_leaves_no_reaction():
    points, triangles = random_mesh(200, seed=6)
    matrix, true, _ = assembled(points, triangles, 1.0, 0.0)
    shift = np.random.default_rng(1).uniform(1, 2, len(points))
    found = recover(matrix + sp.diags_array(shift))
    assert found.certified
    assert found.reaction == 0
    assert largest_error(found.points, true) < 1e-9
