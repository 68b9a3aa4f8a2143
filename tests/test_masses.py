"""Meshes in their true size, or with their density, from a mass matrix beside the stiffness matrix, by scikit-fem."""

import json

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
import skfem as fem
from click.testing import CliRunner
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity
from skfem.models.poisson import laplace, mass

from unassemble import InputError, RecoveryError, recover
from unassemble.certificate import certify_mesh
from unassemble.cli import main
from unassemble.matrix import check_matrix

DENSITY, MODULUS = 7.8, 5.0


def moved(mesh, seed=0, size=0.02):
    return type(mesh)(mesh.p + np.random.default_rng(seed).uniform(-size, size, mesh.p.shape), mesh.t)


def shuffled(*matrices, seed=3):
    place = np.random.default_rng(seed).permutation(matrices[0].shape[0])
    return [sp.csr_array(A)[place][:, place] for A in matrices], place


def scalar(mesh, density=DENSITY):
    basis = fem.Basis(mesh, fem.ElementTriP1())
    (K, M), place = shuffled(-2.5 * laplace.assemble(basis), density * mass.assemble(basis))
    return K, M, mesh.p.T[place]


def elastic(mesh, element, *, supported=False, mixed=True):
    basis = fem.Basis(mesh, fem.ElementVector(element), intorder=6)
    K = linear_elasticity(*lame_parameters(MODULUS, 0.3)).assemble(basis)
    M = DENSITY * fem.BilinearForm(lambda u, v, w: dot(u, v)).assemble(basis)
    held = basis.get_dofs(lambda x: x[0] < 0.05).all() if supported else []
    kept = np.setdiff1d(np.arange(K.shape[0]), held)
    matrices = [sp.csr_array(one[kept][:, kept]) for one in (K, M)]
    (K, M), place = shuffled(*matrices) if mixed else (matrices, slice(None))
    return K, M, basis.doflocs.T[kept][place]


def distances(points):
    return np.linalg.norm(points - points[0], axis=1)


LAKE = fem.MeshTri.init_circle(3).scaled(4.0)
RIGHT = fem.MeshTri().refined(3).scaled((3.0, 1.0))  # its diagonals have vanished from the stiffness matrix


@pytest.mark.parametrize(("mesh", "lumped"), [(moved(LAKE), False), (moved(LAKE), True), (RIGHT, False)])
def test_the_size_of_a_mesh_in_the_plane(mesh, lumped):
    K, M, true = scalar(mesh, density=1.0)
    M = sp.diags_array(M.sum(axis=1)) if lumped else M
    K = K + sp.diags_array(np.random.default_rng(1).standard_normal(K.shape[0])) if mesh is not RIGHT else K
    found = recover(K, mass=M)
    assert found.certified, found.reason
    assert found.density == 1.0
    assert any("lengths are those given here over sqrt(rho)" in note for note in found.warnings)
    assert "mass matrix" in found.reason
    np.testing.assert_allclose(distances(found.points), distances(true), rtol=1e-10)
    assert found.n_polygons == 0  # which diagonal each square has is in the mass matrix only
    assert len(found.triangles) == mesh.nelements


def test_the_density_where_anchors_tell_the_size():
    K, M, true = scalar(moved(LAKE))
    found = recover(K, mass=M, anchors=[(k, *true[k]) for k in (0, 40, 90)])
    assert found.certified
    assert found.density == pytest.approx(DENSITY, rel=1e-10)
    np.testing.assert_allclose(found.points, true, atol=1e-9)
    assert found.report()["density"] == found.density


def test_pieces_in_the_same_scale():
    """The stiffness matrix does not tell how large one piece is beside another."""
    one, other = scalar(moved(LAKE), density=1.0), scalar(moved(LAKE, seed=5).scaled(3.0), density=1.0)
    n = len(one[2])
    found = recover(sp.block_diag(one[:1] + other[:1]), mass=sp.block_diag([one[1], other[1]]))
    assert found.certified
    for part, true in ((slice(0, n), one[2]), (slice(n, None), other[2])):
        np.testing.assert_allclose(distances(found.points[part]), distances(true), rtol=1e-10)


BODIES = {
    "tetrahedra": (moved(fem.MeshTet().refined(2)), fem.ElementTetP1()),
    "hexahedra": (moved(fem.MeshHex().refined(2)), fem.ElementHex1()),
    "quadrilaterals": (moved(fem.MeshQuad().refined(3)), fem.ElementQuad1()),
}


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("supported", [False, True])
def test_the_size_and_the_modulus_of_a_body(name, supported):
    """With another density than 1 both are those that belong to the size in which it is 1."""
    mesh, element = BODIES[name]
    K, M, true = elastic(mesh, element, supported=supported)
    found = recover(K, mass=M)
    assert found.certified, found.reason
    times = DENSITY ** (1 / found.dim)
    rows = np.flatnonzero(found.node_status[found.node_of_row] == 0)
    assert len(rows) > 0.7 * len(true)
    placed = found.points[found.node_of_row[rows]]
    np.testing.assert_allclose(distances(placed), times * distances(true[rows]), rtol=1e-8)
    np.testing.assert_allclose(found.scale, MODULUS / 2.6 / times ** (found.dim - 2), rtol=1e-8)
    assert ("all cells of which" in found.reason) == supported


def test_few_digits():
    K, M, true = scalar(moved(LAKE), density=1.0)
    M.data = np.array([float(f"{value:.6e}") for value in M.data])
    found = recover(K, mass=M)
    assert found.certified
    np.testing.assert_allclose(distances(found.points), distances(true), rtol=1e-5)


@pytest.mark.parametrize("digits", [6, 8])
def test_a_stiffness_matrix_of_few_digits(digits):
    """It tells no moduli, and positions as closely as the certificate says."""
    K, M, true = elastic(*BODIES["quadrilaterals"], mixed=False)
    K.data = np.array([float(f"{value:.{digits - 1}e}") for value in K.data])
    found = recover(K, mass=M)
    assert found.certified, found.reason
    times = DENSITY ** (1 / found.dim)
    diameter = times * distances(true).max()
    off = distances(found.points[found.node_of_row]) - times * distances(true)
    assert np.abs(off).max() < found.position_error * diameter


def of_another_mesh():
    return scalar(moved(LAKE, seed=9))[1]


def of_varying_density():
    form = fem.BilinearForm(lambda u, v, w: (1 + 0.1 * w.x[0]) * u * v)
    return shuffled(form.assemble(fem.Basis(moved(LAKE), fem.ElementTriP1())))[0][0]


def with_one_wrong_entry():
    M = scalar(moved(LAKE))[1].tolil()
    M[0, 0] *= 1 + 1e-7
    return M.tocsr()


@pytest.mark.parametrize("other", [of_another_mesh, of_varying_density, with_one_wrong_entry])
def test_no_mass_matrix_of_this_mesh(other):
    with pytest.raises(RecoveryError, match="is not the mass matrix of this mesh with one density"):
        recover(scalar(moved(LAKE))[0], mass=other())


def test_what_is_refused_at_once():
    K, M, _ = scalar(moved(LAKE))
    with pytest.raises(InputError, match="differ in size"):
        recover(K, mass=M[1:][:, 1:])
    with pytest.raises(RecoveryError, match="not all of its diagonal entries are positive"):
        recover(K, mass=-M)
    K, M, _ = scalar(RIGHT)
    with pytest.raises(RecoveryError, match="into which triangles"):
        recover(K, mass=sp.diags_array(M.sum(axis=1)))
    basis = fem.Basis(moved(LAKE), fem.ElementTriP2())
    (K, M), _ = shuffled(laplace.assemble(basis), mass.assemble(basis))
    with pytest.raises(RecoveryError, match="triangle6"):
        recover(K, mass=M)


def test_at_the_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    K, M, true = scalar(moved(LAKE), density=1.0)
    for name, A in (("K.mtx", K), ("M.mtx", M), ("small.mtx", M[1:][:, 1:])):
        scipy.io.mmwrite(name, sp.coo_array(A), precision=17)
    runner = CliRunner()
    result = runner.invoke(main, ["recover", "K.mtx", "-o", "m.npz", "--mass", "M.mtx", "--report", "r.json"])
    assert result.exit_code == 0, result.stderr
    assert json.loads((tmp_path / "r.json").read_text())["density"] == 1.0
    np.testing.assert_allclose(distances(np.load("m.npz")["points"]), distances(true), rtol=1e-10)
    assert runner.invoke(main, ["recover", "K.mtx", "-o", "n.npz", "--mass", "small.mtx"]).exit_code == 2
    assert not (tmp_path / "n.npz").exists()


def test_a_mass_term_in_the_matrix_itself():
    K, M, _ = scalar(moved(LAKE), density=1.0)
    with pytest.raises(RecoveryError, match="a mass term of its own"):
        recover(K - 0.7 * M, mass=M)


def test_one_anchor_tells_no_size():
    K, M, true = scalar(moved(LAKE), density=1.0)
    found = recover(K, mass=M, anchors=[(7, 3.0, -2.0)])
    assert found.density == 1.0
    np.testing.assert_allclose(found.points[7], (3, -2), atol=1e-12)
    np.testing.assert_allclose(distances(found.points), distances(true), rtol=1e-9)


@pytest.mark.parametrize("place", [1e3, 1e5])
def test_the_mesh_in_its_size_is_held_against_the_stiffness_matrix_again(place):
    """Far from the origin it has fewer digits than the mesh that the stiffness matrix alone gives."""
    K, M, _ = scalar(moved(LAKE), density=1.0)
    found, alone = recover(K, mass=M, anchors=[(7, place, place)]), recover(K)
    assert found.certified
    again = certify_mesh(check_matrix(K), found).backward_error
    assert found.backward_error == max(again, recover(K, anchors=[(7, place, place)]).backward_error)
    assert found.backward_error > 10 * alone.backward_error
    assert "in this size the stiffness matrix to" in found.reason


def test_a_tensor_and_a_size():
    basis = fem.Basis(moved(LAKE), fem.ElementTriP1())
    form = fem.BilinearForm(lambda u, v, w: 2 * u.grad[0] * v.grad[0] + u.grad[1] * v.grad[1])
    (K, M), place = shuffled(form.assemble(basis), mass.assemble(basis))
    true = basis.doflocs.T[place]
    way = true[1] - true[0]
    others = (true - true[0]).mean(axis=0)
    side = "left" if way[0] * others[1] - way[1] * others[0] > 0 else "right"
    degrees = np.degrees(np.arctan2(way[1], way[0]))
    found = recover(K, mass=M, tensor=(2.0, 0.0, 1.0), direction=(0, 1, degrees), handed=side)
    assert found.certified, found.reason
    assert found.backward_error < 1e-11
    assert "in this size the stiffness matrix to" in found.reason
    np.testing.assert_allclose(distances(found.points), distances(true), rtol=1e-9)


@pytest.mark.parametrize("name", ["scalar", "tetrahedra"])
def test_a_small_mesh_far_from_the_origin(name):
    """Digits are lost there; this is no other mass matrix."""
    K, M, true = scalar(moved(LAKE), density=1.0) if name == "scalar" else elastic(*BODIES[name])
    dim = true.shape[1]
    with pytest.raises(RecoveryError, match=r"too few digits that far from the origin: subtract a point near \(1000"):
        recover(K, mass=1e-6**dim * M, anchors=[(0, *[1e3] * dim)])
    assert recover(K, mass=1e-6**dim * M).certified


def test_areas_are_held_against_no_mass():
    M = scalar(moved(LAKE))[1]
    with pytest.raises(RecoveryError, match="a mass term of its own"):
        recover(M, mass=M)


@pytest.mark.parametrize("given", [np.zeros(3), np.full((2, 2), None), object()])
def test_no_matrix_at_all(given):
    K = scalar(moved(LAKE))[0]
    with pytest.raises(RecoveryError, match="`mass`: "):
        recover(K, mass=given)
    with pytest.raises(RecoveryError, match="matri"):
        recover(given, mass=K)
