"""c L + s M from scikit-fem, rows permuted at random: the mesh, its size, and both factors."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementTriP1, MeshTri
from skfem.helpers import dot, grad

from meshes import delaunay, largest_error, random_mesh, triangle_set
from unassemble import FormatError, MatrixError, RecoveryError, recover
from unassemble.certificate import Terms
from unassemble.cli import main
from unassemble.masses import RowSums
from unassemble.matrix import check_matrix
from unassemble.words import Reason


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


def test_triangles_graded_over_four_orders_of_magnitude():
    points = np.random.default_rng(2).uniform(-1, 1, (200, 2))
    points, triangles = delaunay(points * 10.0 ** (4 * np.abs(points).max(axis=1, keepdims=True) - 4))
    s = 2.5e-3 / (2 * areas(points, triangles).mean())
    matrix, true, cells = assembled(points, triangles, 2.5, s)
    found = recover(matrix)
    assert found.certified, found.reason
    assert triangle_set(found.triangles) == triangle_set(cells)
    assert largest_error(found.points, true) < 1e-9


def test_a_wrong_entry_is_no_certificate():
    points, triangles = delaunay(np.random.default_rng(2).uniform(size=(60, 2)))
    matrix, _, _ = assembled(points, triangles, 1.0, 30.0)
    dense = matrix.toarray()
    i, j = np.argwhere(np.triu(dense, 1))[40]
    for pair in ((i, j), (j, i)):
        dense[pair] *= 1 + 1e-5
    found = recover(dense)
    assert found.status != "certified"


@pytest.mark.parametrize("lumped", [False, True])
def test_the_whole_matrix_is_counted(lumped):
    """Entries on the diagonal as well as those beside it."""
    points, triangles = random_mesh(200, seed=3)
    matrix, _, _ = assembled(points, triangles, 1.0, 300.0, lumped=lumped)
    found = recover(matrix)
    assert found.certified
    assert found.n_fitting == found.n_entries == sp.triu(matrix).nnz


def test_what_speaks_against_the_mesh_comes_first():
    """Objections and other meshes of the Laplacian alone are those of the whole matrix, and no praise precedes them."""
    points, triangles = random_mesh(100, seed=4)
    matrix = check_matrix(assembled(points, triangles, 1.0, 50.0)[0])
    found = recover(assembled(points, triangles, 1.0, 0.0)[0])
    terms, held = Terms(matrix.diagonal, 50.0), RowSums(matrix)
    scaled = held.with_terms(replace(found, points=found.points * _size(found, points, triangles)), terms, "c L + s M")
    assert scaled.certified, scaled.reason
    reason = Reason("something is wrong", advice="mend it")

    doubtful = replace(scaled, verdict=scaled.verdict.despite(reason))
    verdict = held.with_terms(doubtful, terms, "c L + s M").verdict
    assert (verdict.objections, verdict.reasons, verdict.advice) == ((reason,), reason.sentences, "mend it")

    ambiguous = replace(scaled, verdict=scaled.verdict.beside(Reason("another mesh fits")))
    verdict = held.with_terms(ambiguous, terms, "c L + s M").verdict
    assert verdict.status == "ambiguous"
    assert verdict.reasons[0] == "another mesh fits"

    verdict = held.with_terms(doubtful, replace(terms, reaction=51.0), "c L + s M").verdict
    assert len(verdict.objections) == 2
    assert verdict.reasons[0].endswith("(relative) only")
    assert verdict.objections[1] == reason


def _size(found, points, triangles):
    """How many times as large the true mesh is."""
    return np.sqrt(areas(points, triangles).sum() / areas(found.points, found.triangles).sum())


def test_any_other_diagonal_leaves_no_reaction():
    points, triangles = random_mesh(200, seed=6)
    matrix, true, _ = assembled(points, triangles, 1.0, 0.0)
    shift = np.random.default_rng(1).uniform(1, 2, len(points))
    found = recover(matrix + sp.diags_array(shift))
    assert found.certified
    assert found.reaction == 0
    assert largest_error(found.points, true) < 1e-9


def test_pieces_that_touch_get_their_relative_sizes():
    left, cells = random_mesh(80, seed=7, holes=False)
    corner = int(np.argmax(left @ [1.0, 1.0]))
    right = left[corner] + 3 * (left - left[corner]) * [-1, -1]
    join = np.where(np.arange(len(left)) == corner, corner, len(left) + np.arange(len(left)))
    points, used = np.vstack([left, right]), np.vstack([cells, join[cells]])
    rows, used = np.unique(used, return_inverse=True)
    points, triangles = points[rows], used.reshape(-1, 3)
    matrix, _, _ = assembled(points, triangles, 1.0, 50.0)
    found = recover(matrix)
    assert found.certified
    assert found.n_components == 2
    sizes = [areas(found.points, found.triangles[here]).sum() for here in _by_piece(found)]
    assert max(sizes) / min(sizes) == pytest.approx(9, rel=1e-9)


def _by_piece(found):
    label = found.component[found.triangles].max(axis=1)
    return [label == k for k in range(found.n_components)]


def test_mass_matrix_alone_tells_areas_and_no_shape(tmp_path):
    points, triangles = random_mesh(300, seed=8)
    matrix, true, cells = assembled(points, triangles, 0.0, 4.0)
    found = recover(matrix)
    assert found.certified
    assert "no shape" in found.reason
    assert triangle_set(found.triangles) == triangle_set(cells)
    assert np.allclose(found.areas, 4 * areas(true, found.triangles), rtol=1e-11, atol=0)
    found.save(tmp_path / "mass.npz")
    saved = np.load(tmp_path / "mass.npz")
    assert "points" not in saved
    assert np.array_equal(saved["areas"], found.areas)
    with pytest.raises(FormatError, match="areas only"):
        found.save(tmp_path / "mass.vtu")
    with pytest.raises(FormatError, match="no shape"):
        found.plot()
    assert found.report()["operator"] == "mass"


def test_mass_matrix_with_a_wrong_entry_is_not_certified():
    points, triangles = random_mesh(100, seed=9)
    dense = assembled(points, triangles, 0.0, 1.0)[0].toarray()
    i, j = np.argwhere(np.triu(dense, 1))[50]
    dense[[i, j], [j, i]] *= 1 + 1e-6
    try:
        status = recover(dense).status
    except RecoveryError:
        return
    assert status != "certified"


@pytest.mark.parametrize("c", [2.0, -0.5])
@pytest.mark.parametrize("jacobi", [False, True])
def test_scaled_unknowns(c, jacobi):
    points, triangles = random_mesh(300, seed=10)
    matrix, true, cells = assembled(points, triangles, c, 0.0)
    diagonal = matrix.tocsr().diagonal()
    rng = np.random.default_rng(4)
    scaling = np.abs(diagonal) ** -0.5 if jacobi else np.exp(rng.uniform(-3, 3, len(points)))
    found = recover(sp.diags_array(scaling) @ matrix @ sp.diags_array(scaling))
    assert found.certified
    assert triangle_set(found.triangles) == triangle_set(cells)
    assert largest_error(found.points, true) < 1e-9
    mean = np.exp(np.log(scaling).mean())
    assert np.allclose(found.row_scaling, scaling / mean, rtol=1e-8)
    assert found.scale[0] == pytest.approx(c * mean**2, rel=1e-8)


@pytest.mark.slow
def test_scaled_unknowns_with_a_diagonal_are_not_determined():
    points, triangles = random_mesh(100, seed=11)
    matrix, _, _ = assembled(points, triangles, 1.0, 0.0)
    rng = np.random.default_rng(4)
    scaling = sp.diags_array(rng.uniform(0.5, 2, len(points)))
    with pytest.raises(RecoveryError):
        recover(scaling @ (matrix + sp.diags_array(rng.uniform(1, 2, len(points)))) @ scaling)


def test_convection_is_taken_off():
    """b = (-y, x) on a disc: no flow through the boundary, an antisymmetric matrix whose rows add up to zero."""
    mesh = MeshTri.init_circle(3)
    basis = Basis(mesh, ElementTriP1())
    stiffness = BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(basis)
    stream = mesh.p[0] ** 2 + 2 * mesh.p[1] ** 2
    inner = np.setdiff1d(np.arange(mesh.p.shape[1]), mesh.boundary_nodes())
    flow = np.where(np.isin(np.arange(len(stream)), inner), stream, 3.0)

    @BilinearForm
    def carried(u, v, w):
        slope = grad(w.flow)
        return v * (-slope[1] * grad(u)[0] + slope[0] * grad(u)[1])

    convection = carried.assemble(basis, flow=basis.interpolate(flow))
    place = np.random.default_rng(0).permutation(len(flow))
    matrix = (stiffness + 7 * convection)[np.argsort(place)][:, np.argsort(place)]
    assert abs(matrix - matrix.T).max() > 0.1
    found = recover(matrix)
    assert found.certified
    assert any("symmetric part" in warning for warning in found.warnings)
    assert largest_error(found.points, mesh.p.T[np.argsort(place)]) < 1e-9
    row, column = (matrix.tocoo().row[0], matrix.tocoo().col[1])
    spoilt = matrix.tolil()
    spoilt[row, column] += 0.5
    with pytest.raises(MatrixError, match=r"(?s)not symmetric.*convection"):
        recover(spoilt.tocsr())


def test_real_part_of_a_complex_matrix():
    points, triangles = random_mesh(150, seed=12)
    stiffness, true, _ = assembled(points, triangles, 1.0, 0.0)
    mass, _, _ = assembled(points, triangles, 0.0, 1.0)
    found = recover(stiffness - (30 + 5j) * mass)
    assert found.certified
    assert largest_error(found.points, true) < 1e-9
    assert found.reaction < 0
    assert any("real part" in warning for warning in found.warnings)


def test_through_the_command(tmp_path):
    points, triangles = random_mesh(150, seed=13)
    matrix, _, _ = assembled(points, triangles, 1.0, 100.0)
    file = tmp_path / "a.npz"
    sp.save_npz(file, matrix.tocsr())
    with pytest.raises(SystemExit) as ended:
        main(
            ["recover", str(tmp_path / "a.npz"), "-o", str(tmp_path / "mesh.npz"), "--report", str(tmp_path / "r.json")]
        )
    assert ended.value.code == 0
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["status"] == "certified"
    assert report["uniqueness"] == "searched"
    assert report["reaction"] > 0


def test_scaled_unknowns_of_a_mesh_whose_sides_have_vanished():
    """Of right triangles zeros are not stored, and the graph does not show the cells."""
    basis = Basis(MeshTri().refined(3), ElementTriP1())
    stiffness = sp.csr_array(BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(basis))
    stiffness.data[np.abs(stiffness.data) < 1e-14] = 0
    stiffness.eliminate_zeros()
    place = np.random.default_rng(0).permutation(stiffness.shape[0])
    scaling = sp.diags_array(stiffness.diagonal() ** -0.5)
    found = recover(sp.csr_array(scaling @ stiffness @ scaling)[place][:, place])
    assert found.certified, found.reason
    assert largest_error(found.points, basis.mesh.p.T[place]) < 1e-11
    np.testing.assert_allclose(
        found.row_scaling * np.sqrt(stiffness.diagonal()[place]),
        found.row_scaling[0] * np.sqrt(stiffness.diagonal()[place[0]]),
    )
