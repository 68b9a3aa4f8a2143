"""Vector-valued matrices through the command line."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import meshio
import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
import skfem
import skfem.models.poisson

from meshes import random_mesh
from unassemble import InputError, NotPlanarError, recover

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "elasticity"))

from assembled import (
    Assembled,
    box,
    eliminated,
    error,
    on_plane,
    orthotropic,
    permuted_nodes,
    stiffness,
    vector_laplace,
    with_identity,
)

SPATIAL = {"tet-p1": "tetrahedra", "hex-q1": "hexahedra"}
FLAT = {"tri-p1": "triangles", "quad-q1": "quads"}
CELLS = SPATIAL | FLAT


def body(kind: str) -> Assembled:
    counts = (7, 8) if kind in FLAT else (4, 5, 5)
    return permuted_nodes(stiffness(kind, box(kind, counts, perturb=0.2), lam=1.5), seed=5)


def clamped(given: Assembled) -> tuple[sp.csr_array, np.ndarray]:
    return eliminated(given, np.repeat(on_plane(given, 0)[:, None], given.dim, axis=1))


@pytest.mark.parametrize("kind", CELLS)
@pytest.mark.parametrize("operator", [(), ("--operator", "elasticity")])
def test_npz_and_report(work, kind, operator):
    given = body(kind)
    work.write("E.mtx", given.matrix)
    result = work.recover("--report", "r.json", *operator, matrix="E.mtx")
    assert result.exit_code == 0, result.stderr
    mesh, report = work.mesh(), json.loads(Path("r.json").read_text())
    n, d = given.points.shape
    assert error(mesh["points"], given.points) < 1e-10
    cells = mesh[CELLS[kind]]
    assert {frozenset(c) for c in cells.tolist()} == {frozenset(c) for c in given.cells.tolist()}
    assert not {"triangles", "quads", "tetrahedra", "hexahedra"} - {CELLS[kind]} & set(mesh)
    assert mesh["node_of_row"].tolist() == np.repeat(np.arange(n), d).tolist()
    assert mesh["direction_of_row"].tolist() == np.tile(np.arange(d), n).tolist()
    assert mesh["node_status"].dtype == np.int8
    assert not mesh["node_status"].any()
    assert mesh["scale"].shape == (1,)
    assert np.abs(mesh["points"].mean(axis=0)).max() < 1e-12
    facts = {"status": "certified", "operator": "elasticity", "n_points": n, "n_cells": len(given.cells)}
    facts |= {"n_components": 1, "n_holes": None, "block_size": d, "numbering": "interleaved", "dimension": d}
    assert {key: report[key] for key in facts} == facts
    assert report["backward_error"] <= 1e-9
    assert report["poisson_ratio"] == pytest.approx(0.3, abs=1e-9)
    assert report["evidence"][0]["null_dimension"] == d + 1
    assert report["evidence"][0]["gap"] > 1e3 * report["evidence"][0]["residual"]
    assert bool(report["operator_choice"]) == (not operator)
    assert any("sign" in warning for warning in report["warnings"])


@pytest.mark.parametrize("kind", CELLS)
def test_cells_in_a_file_for_others(work, kind):
    given = body(kind)
    work.write("E.mtx", given.matrix)
    assert work.recover(matrix="E.mtx", out="mesh.vtu").exit_code == 0
    mesh = meshio.read("mesh.vtu")
    (block,) = mesh.cells
    assert {frozenset(c) for c in block.data.tolist()} == {frozenset(c) for c in given.cells.tolist()}
    assert np.ravel(mesh.point_data["row_x"]).tolist() == (given.dim * np.arange(len(given.points))).tolist()


def test_a_format_that_cannot_hold_the_cells(work, one_sentence):
    work.write("E.mtx", body("hex-q1").matrix)
    result = work.recover(matrix="E.mtx", out="mesh.stl")
    assert result.exit_code == 4
    assert "hexahedron" in one_sentence(result)
    assert "mesh.stl" not in work.files()


def test_clamped_with_nodes_in_another_order(work):
    given = body("hex-q1")
    matrix, nodes = clamped(given)
    n = len(nodes)
    rows = np.arange(3 * n).reshape(n, 3).T.ravel()
    work.write("E.mtx", matrix[rows][:, rows])
    for words in ((), ("--numbering", "component"), ("--block-size", "3")):
        assert work.recover(*words, matrix="E.mtx").exit_code == 0
        assert error(work.mesh()["points"], given.points[nodes]) < 1e-10


def test_nodes_without_equations_are_said_not_guessed(work, one_sentence):
    given = body("tet-p1")
    gone = np.repeat(on_plane(given, 0)[:, None], 3, axis=1)
    work.write("E.mtx", with_identity(given, gone))
    assert work.recover("--report", "r.json", matrix="E.mtx").exit_code == 0
    mesh = work.mesh()
    assert np.array_equal(mesh["node_status"] == 1, gone.all(axis=1))
    assert np.isnan(mesh["points"][gone.all(axis=1)]).all()
    assert json.loads(Path("r.json").read_text())["n_undetermined"] == gone.all(axis=1).sum()
    result = work.recover(matrix="E.mtx", out="mesh.inp")
    assert result.exit_code == 4
    assert "node" in one_sentence(result)


def test_anchors_fix_size_and_sign(work):
    given = body("tet-p1")
    work.write("E.mtx", given.matrix)
    first, last = 0, len(given.points) - 1
    words = []
    for node in (first, last):
        x, y, z = given.points[node].tolist()
        words += ["--anchor", f"{3 * node},{x!r},{y!r},{z!r}"]
    assert work.recover(*words, matrix="E.mtx").exit_code == 0
    mesh = work.mesh()
    np.testing.assert_allclose(mesh["points"], given.points, atol=1e-10)
    assert mesh["scale"] == pytest.approx(1.0)  # the shear modulus that the matrix was assembled with


@pytest.mark.parametrize(("far", "status"), [(0.0, "certified"), (100.0, "certified"), (1e8, "uncertified")])
def test_anchors_far_from_the_origin(far, status):
    given = body("tet-p1")
    points = 0.3 * given.points + far
    anchors = [(3 * node, *points[node]) for node in (2, 11)]
    found = recover(given.matrix, anchors=anchors)
    assert found.status == status
    assert ("too few digits" in found.reason) == (status == "uncertified")
    assert np.abs(found.points - points).max() < 1e-15 * far + 1e-10


def test_anchors_that_do_not_fit(work, one_sentence):
    work.write("E.mtx", body("tet-p1").matrix)
    for words, why in (
        (["0,1,2"], "needs 3 finite coordinates"),
        (["0,1,2,3", "2,1,2,5"], "belong to one node"),
        (["99999,1,2,3"], "row 99999"),
    ):
        result = work.recover(*(w for word in words for w in ("--anchor", word)), matrix="E.mtx")
        assert result.exit_code == 2
        assert why in one_sentence(result)


def test_material_that_is_not_isotropic_is_a_best_fit(work):
    given = stiffness("quad-q1", box("quad-q1", (8, 8), perturb=0.2), form=orthotropic)
    work.write("E.mtx", given.matrix)
    result = work.recover("--report", "r.json", matrix="E.mtx")
    assert result.exit_code == 3
    report = json.loads(Path("r.json").read_text())
    assert report["status"] == "uncertified"
    assert report["evidence"][0]["residual"] > 1e-6
    assert report["scale"] == [None]
    assert len(work.mesh()["points"]) == len(given.points)


def test_options_of_scalar_matrices(work, one_sentence):
    work.write("E.mtx", body("tri-p1").matrix)
    result = work.recover("--noise", "1e-3", matrix="E.mtx")
    assert result.exit_code == 2
    assert "--noise is for scalar matrices" in one_sentence(result)
    assert work.recover("--no-refine", "--threads", "1", matrix="E.mtx").exit_code == 0


@pytest.mark.parametrize("order", ["interleaved", "by component", "zeros stored"])
def test_vector_laplacians_are_two_meshes_side_by_side(work, order):
    points, triangles = random_mesh(150, seed=2)
    mesh = skfem.MeshTri(points.T, triangles.T)
    given = stiffness("tri-p1", mesh, form=vector_laplace).matrix
    n = len(points)
    if order == "by component":
        rows = np.arange(2 * n).reshape(n, 2).T.ravel()
        given = given[rows][:, rows]
    elif order == "interleaved":
        given.eliminate_zeros()
    else:
        scalar = stiffness("tri-p1", mesh, form=vector_laplace).matrix[::2, ::2].tocoo()
        blocks = scalar.data[:, None, None] * np.eye(2)
        pairs = np.arange(2)
        row = 2 * scalar.row[:, None, None] + pairs[:, None] + 0 * pairs
        column = 2 * scalar.col[:, None, None] + pairs + 0 * pairs[:, None]
        given = sp.csr_array((blocks.ravel(), (row.ravel(), column.ravel())), shape=(2 * n, 2 * n))
    work.write("V.mtx", given)
    result = work.recover("--report", "r.json", matrix="V.mtx")
    assert result.exit_code == 0, result.stderr
    found, report = work.mesh(), json.loads(Path("r.json").read_text())
    assert report["operator"] == "laplacian"
    assert report["n_components"] == 2
    place = np.arange(2 * n) % n if order == "by component" else np.arange(2 * n) // 2
    cells = Counter(frozenset(t) for t in place[found["triangles"]].tolist())
    assert cells == Counter({frozenset(t): 2 for t in triangles.tolist()})


def test_vector_laplacians_in_space_are_not_recoverable(work, one_sentence):
    given = stiffness("tet-p1", box("tet-p1", (4, 4, 4)), form=vector_laplace).matrix
    work.write("V.mtx", given)
    result = work.recover("--operator", "elasticity", matrix="V.mtx")
    assert result.exit_code == 4
    assert "vector Laplacian" in one_sentence(result)


HOSTILE = {
    "not symmetric": (lambda a: a + sp.coo_array(([1.0], ([0], [5])), shape=a.shape), 4, "not symmetric"),
    "not finite": (lambda a: a + sp.coo_array(([np.nan], ([0], [0])), shape=a.shape), 4, "nan"),
    "not square": (lambda a: a[:-1], 4, "not square"),
    "tiny": (lambda a: sp.csr_array(np.array([[2.0, 1.0], [1.0, 2.0]])), 4, ""),
    "all ones": (lambda a: sp.csr_array(np.ones((12, 12))), 4, ""),
    "random": (lambda a: _random(), 4, ""),
    "each row scaled": (lambda a: sp.csr_array(_scales(a) @ a @ _scales(a)), 4, "scaled"),
}


def _random() -> sp.csr_array:
    noise = sp.random_array((60, 60), density=0.15, rng=np.random.default_rng(0))
    return sp.csr_array(noise + noise.T + 10 * sp.eye_array(60))


def _scales(a: sp.csr_array) -> sp.dia_array:
    return sp.diags_array(np.random.default_rng(1).uniform(1, 2, a.shape[0]))


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_matrices(work, one_sentence, case):
    spoil, status, why = HOSTILE[case]
    work.write("E.mtx", spoil(body("tri-p1").matrix))
    for words in (("--operator", "elasticity"), ()):
        result = work.recover(*words, matrix="E.mtx")
        assert result.exit_code == status, result.stderr
        assert words == () or why in one_sentence(result)
        one_sentence(result)
    assert "mesh.npz" not in work.files()


def test_wrong_block_sizes(work, one_sentence):
    work.write("E.mtx", body("tri-p1").matrix)
    result = work.recover("--block-size", "3", matrix="E.mtx")
    assert result.exit_code == 4
    assert "3 unknowns" in one_sentence(result)
    work.write("A3.mtx", sp.csr_array(body("tri-p1").matrix)[:-1, :-1])
    result = work.recover("--numbering", "interleaved", "--block-size", "2", matrix="A3.mtx")
    assert result.exit_code == 2
    assert "interleaved" in one_sentence(result)


def test_scalar_matrices_stay_scalar(work):
    assert work.recover("--report", "r.json").exit_code == 0
    report = json.loads(Path("r.json").read_text())
    assert report["operator"] == "laplacian"
    assert "operator_choice" not in report
    assert "node_of_row" not in work.mesh()


def test_a_scalar_matrix_that_is_not_planar_is_refused_as_such():
    mesh = skfem.MeshTet.init_tensor(*(np.linspace(0, 1, 5),) * 3)
    matrix = skfem.models.poisson.laplace.assemble(skfem.Basis(mesh, skfem.ElementTetP1()))
    with pytest.raises(NotPlanarError):
        recover(matrix)


def test_python_options():
    given = body("tri-p1")
    n, d = given.points.shape
    rows = np.random.default_rng(0).permutation(n * d)
    matrix = given.matrix[rows][:, rows]
    found = recover(matrix, numbering=(rows // d, rows % d))
    truth = np.empty((n, d))
    truth[found.node_of_row] = given.points[rows // d]
    assert error(found.points, truth) < 1e-10
    assert found.numbering == "given"
    assert recover(given.matrix, cells=False).n_cells == 0
    for wrong in ("sideways", 7, (rows // d, rows % d, 0)):
        with pytest.raises(InputError, match="numbering"):
            recover(matrix, numbering=wrong)
    with pytest.raises(InputError, match="2 directions"):
        recover(matrix, numbering=(rows // d, rows % d), block_size=3)
    with pytest.raises(InputError, match="vector-valued"):
        recover(matrix, operator="laplacian", block_size=2)


@pytest.mark.parametrize(("kind", "columns"), [("hex-q1", 6), ("quad-q1", 3)])
def test_modes(work, kind, columns):
    given = body(kind)
    work.write("E.mtx", given.matrix)
    result = work.run("modes", "E.mtx", "-o", "B.npy", "--petsc", "x.petsc", "--amgcl", "x.mtx", "--report", "r.json")
    assert result.exit_code == 0, result.stderr
    modes = np.load("B.npy")
    assert modes.shape == (given.matrix.shape[0], columns)
    assert np.linalg.matrix_rank(modes) == columns
    assert np.abs(given.matrix @ modes).max() < 1e-11 * abs(given.matrix).sum(axis=1).max()
    points = scipy.io.mmread("x.mtx")
    assert error(points, given.points) < 1e-10
    assert np.array_equal(np.fromfile("x.petsc", ">f8", offset=8), points.ravel())
    assert json.loads(Path("r.json").read_text())["status"] == "certified"
    assert np.array_equal(recover(given.matrix).rigid_body_modes(), modes)
    assert work.run("modes", "E.mtx", "-o", "B.mtx").exit_code == 0
    np.testing.assert_allclose(scipy.io.mmread("B.mtx"), modes, rtol=1e-15, atol=1e-300)


def test_modes_of_other_matrices(work, one_sentence):
    result = work.run("modes", "A.mtx", "-o", "B.npy")
    assert result.exit_code == 4
    assert "no elasticity matrix" in one_sentence(result)
    with pytest.raises(InputError, match="scalar"):
        recover("A.mtx").rigid_body_modes()


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["-o", "B.txt"], ".npy"),
        (["-o", "no/B.npy"], "no folder"),
        (["-o", "B.npy", "--report", "r.txt"], ".json"),
        (["-o", "B.mtx", "--amgcl", "./B.mtx"], "the same file"),
        (["-o", "B.npy", "--block-size", "5"], "'5'"),
        ([], "-o"),
    ],
)
def test_modes_refused(work, one_sentence, words, why):
    result = work.run("modes", "A.mtx", *words)
    assert result.exit_code == 2
    assert why in one_sentence(result)
    assert work.files() == {"A.mtx"}


def test_modes_of_nodes_without_coordinates(work, one_sentence):
    given = body("tri-p1")
    gone = np.repeat(on_plane(given, 0)[:, None], 2, axis=1)
    work.write("E.mtx", with_identity(given, gone))
    assert work.run("modes", "E.mtx", "-o", "B.npy").exit_code == 0
    modes = np.load("B.npy")
    assert not modes[gone.ravel(), 2].any()
    assert modes[:, :2].sum(axis=1).tolist() == [1.0] * len(modes)
    result = work.run("modes", "E.mtx", "-o", "C.npy", "--petsc", "x.petsc")
    assert result.exit_code == 4
    assert "no coordinates" in one_sentence(result)
    assert not {"C.npy", "x.petsc"} & work.files()


@pytest.mark.parametrize("mesh", [skfem.MeshQuad, skfem.MeshHex])
def test_halves_of_a_scalar_mesh_are_no_directions(mesh):
    """Each half of a grid annihilates constants in itself, which means nothing."""
    element = {skfem.MeshQuad: skfem.ElementQuad1, skfem.MeshHex: skfem.ElementHex1}[mesh]()
    axes = (np.linspace(0, 1, 10),) * element.dim
    matrix = skfem.models.poisson.laplace.assemble(skfem.Basis(mesh.init_tensor(*axes), element))
    if mesh is skfem.MeshQuad:
        assert recover(matrix).element == "Q1"
    else:
        with pytest.raises(NotPlanarError):
            recover(matrix)


def test_inspect(work):
    given = body("tet-p1")
    matrix, nodes = clamped(given)
    work.write("E.mtx", matrix)
    result = work.run("inspect", "E.mtx")
    assert result.exit_code == 0
    assert "vector-valued, 3 components, interleaved: elasticity" in result.stdout
    facts = json.loads(work.run("inspect", "--json", "E.mtx").stdout)
    assert facts["n_nodes"] == len(nodes)
    assert facts["block_size"] == 3
    assert facts["coupled"]
    assert json.loads(work.run("inspect", "--json", "A.mtx").stdout)["block_size"] == 1


@pytest.mark.parametrize("kind", [*CELLS, "tri-p2", "quad-q2", "tet-p2", "hex-q2"])
def test_pictures(work, kind):
    counts = (5, 6) if kind[:3] in ("tri", "qua") else (3, 4, 3)
    given = body(kind) if kind in CELLS else stiffness(kind, box(kind, counts))
    matrix = sp.block_diag([given.matrix, given.matrix], format="csr") if kind == "hex-q1" else given.matrix
    work.write("E.mtx", matrix)
    assert work.recover("--plot", "p.png", "--plot", "p.svg", matrix="E.mtx").exit_code == 0
    text = Path("p.svg").read_text()
    drawn = {"tet": "tetrahedra", "hex": "hexahedra", "qua": "quadrilaterals", "tri": "triangles"}
    figure = recover(matrix).plot()
    (ax,) = figure.axes
    assert "<svg" in text
    assert any(drawn[kind[:3]] in label.get_text() for label in figure.texts)
    facets = [path.vertices for collection in ax.collections[:1] for path in collection.get_paths()]
    if kind in CELLS:
        counts = (7, 8) if kind in FLAT else (4, 5, 5)
    a, b, c = (count - 1 for count in (*counts, 1)[:3])
    sides = a * b + a * c + b * c  # three of the six sides of a box face the eye
    number = {"tri": 2 * a * b, "qua": a * b, "tet": 2 * sides, "hex": sides}[kind[:3]]
    assert len(facets) == number * (2 if kind == "hex-q1" else 1)
    corners = {"tri": 3, "tet": 3}.get(kind[:3], 4)
    assert {len(facet) for facet in facets} == {corners * (1 if kind in CELLS else 2) + 1}


def test_bare_nodes_are_drawn(work):
    given = stiffness("tri-p2", box("tri-p2", (5, 6)))
    figure = recover(given.matrix, cells=False).plot()
    (ax,) = figure.axes
    assert len(ax.lines[0].get_xdata()) == len(given.points)


def test_scalar_matrices_do_not_load_the_elasticity_room(work):
    script = "import sys, unassemble; unassemble.recover('A.mtx'); print('unassemble.elasticity' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
