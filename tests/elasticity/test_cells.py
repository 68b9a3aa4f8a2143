"""Cells of every kind: the right nodes in the right order, certified by re-assembly, in files that others read."""

import numpy as np
import pytest
import skfem
from assembled import ELEMENTS, box, eliminated, heterogeneous, on_plane, permuted_nodes, recover_elasticity, stiffness
from scipy.spatial import Delaunay, cKDTree

from unassemble import recover
from unassemble.elements import KINDS, ordered_boxes

KIND = {
    "tri-p1": "triangle", "tri-p2": "triangle6", "quad-q1": "quad", "quad-s2": "quad8", "quad-q2": "quad9",
    "tet-p1": "tetra", "tet-p2": "tetra10", "hex-q1": "hexahedron", "hex-s2": "hexahedron20",
    "hex-q2": "hexahedron27",
}  # fmt: skip
CURVED = {
    "tri-p2": skfem.MeshTri2,
    "quad-q2": skfem.MeshQuad2,
    "tet-p2": skfem.MeshTet2,
    "hex-q2": skfem.MeshHex2,
}


def mesh(kind, perturb=0.2):
    return box(kind, (5, 6) if KINDS[KIND[kind]].dim == 2 else (3, 4, 3), perturb=perturb, stretch=None)


def corners_of(given):
    """Cells of the mesh as sets of their corners, which scikit-fem numbers before all other nodes."""
    return {frozenset(cell) for cell in given.cells.tolist()}


def only(found):
    """(m, k) the cells, which are of one kind."""
    (cells,) = found.cells.values()
    return cells


def in_their_places(points, cells, kind):
    """Further nodes of straight cells are in the middle of their corners; and cells are positive."""
    x = points[cells]
    middles = np.stack([x[:, list(some)].mean(axis=1) for some in kind.between], axis=1) if kind.quadratic else x[:, :0]
    step = [1, 2] if kind.simplex and kind.dim == 2 else [1, 3] if kind.dim == 2 else [1, 2, 3]
    step = [1, 3, 4] if kind.dim == 3 and not kind.simplex else step
    positive = np.linalg.det(x[:, step] - x[:, :1]) > 0
    return np.abs(x[:, kind.corners :] - middles).max(initial=0) < 1e-9 and positive.all()


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("perturb", [0.0, 0.2])
def test_one_material(kind, perturb):
    given = permuted_nodes(stiffness(kind, mesh(kind, perturb), lam=1.5), seed=1)
    found = recover_elasticity(given.matrix)
    assert list(found.cells) == [KIND[kind]]
    assert found.certified
    assert found.backward_error < 1e-11
    assert {frozenset(cell) for cell in only(found)[:, : given.cells.shape[1]].tolist()} == corners_of(given)
    assert in_their_places(found.points, only(found), KINDS[KIND[kind]])
    assert found.lame[:, 0] / found.lame[:, 1] == pytest.approx(np.full(found.n_cells, 1.5), abs=1e-6)


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("dropped", [False, True])
def test_material_of_each_cell_is_read_off(kind, dropped):
    """Also where entries that vanish are not stored, as between a corner of a quadratic triangle and what faces it."""
    shape = mesh(kind)
    rng = np.random.default_rng(3)
    lam, mu = rng.uniform(1, 3, (2, shape.nelements, 1))
    given = stiffness(kind, shape, lam=lambda x: lam + 0 * x[0], mu=lambda x: mu + 0 * x[0])
    if dropped:
        given.matrix.data[np.abs(given.matrix.data) < 1e-14] = 0
        given.matrix.eliminate_zeros()
    found = recover_elasticity(given.matrix)
    assert found.certified
    number = {frozenset(cell): k for k, cell in enumerate(given.cells.tolist())}
    order = [number[frozenset(cell)] for cell in only(found)[:, : given.cells.shape[1]].tolist()]
    assert len(set(order)) == shape.nelements
    truth = np.hstack([lam, mu])[order]
    assert found.lame * (truth[0, 1] / found.lame[0, 1]) == pytest.approx(truth, rel=1e-7)


@pytest.mark.parametrize("kind", ELEMENTS)
def test_clamped(kind):
    """Cells that lost no node are found, and no others."""
    given = permuted_nodes(
        stiffness(
            kind, box(kind, (6, 5) if "t" in kind[1:2] or kind[:3] in ("tri", "qua") else (4, 3, 3), perturb=0.2)
        ),
        seed=2,
    )
    gone = on_plane(given, 0)
    matrix, nodes = eliminated(given, np.repeat(gone[:, None], given.dim, axis=1))
    found = recover_elasticity(matrix)
    assert len(found.lame)
    whole = {cell for cell in corners_of(given) if not gone[list(cell)].any()}
    seen = {frozenset(cell) for cell in nodes[only(found)[:, : given.cells.shape[1]]].tolist()}
    assert seen <= whole
    assert len(seen) > 0.6 * len(whole)


@pytest.mark.parametrize("kind", CURVED)
def test_curved(kind):
    bent = CURVED[kind].from_mesh(mesh(kind, 0.0))
    x = bent.doflocs
    bent = CURVED[kind](x + 0.04 * np.sin(3 * np.roll(x, 1, axis=0) + 2 * x[-1:]), bent.t)
    given = permuted_nodes(stiffness(kind, bent, lam=1.5, intorder=4), seed=1)
    found = recover_elasticity(given.matrix)
    assert found.certified
    assert list(found.cells) == [KIND[kind]]
    assert len(found.lame)
    assert found.backward_error < 1e-11
    assert {frozenset(c) for c in only(found)[:, : given.cells.shape[1]].tolist()} == corners_of(given)


@pytest.mark.parametrize("kind", ["quad-q1", "quad-s2", "hex-q1", "hex-s2"])
def test_cells_without_certificate_say_so(kind):
    """Material that varies within cells: these come from the graph, the certificate from the identities."""
    given = stiffness(kind, mesh(kind), lam=heterogeneous, mu=lambda x: 1 + x[0] * x[1], within=True)
    found = recover_elasticity(given.matrix)
    assert found.certified
    assert list(found.cells) == [KIND[kind]]
    assert not len(found.lame)
    assert {frozenset(c) for c in only(found)[:, : given.cells.shape[1]].tolist()} == corners_of(given)
    assert any("not certified" in warning for warning in found.warnings)
    assert np.isnan(recover(given.matrix).scale).all()


def test_unstructured_tetrahedra():
    rng = np.random.default_rng(4)
    points = rng.uniform(0, 1, (60, 3))
    cells = Delaunay(points).simplices
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    cells = cells[np.abs(np.linalg.det(edges)) > 0.02 * np.linalg.norm(edges, axis=2).max(axis=1) ** 3]
    used, cells = np.unique(cells, return_inverse=True)
    shape = skfem.MeshTet(points[used].T.copy(), cells.reshape(-1, 4).T.copy())
    for kind in ("tet-p1", "tet-p2"):
        given = permuted_nodes(stiffness(kind, shape, lam=0.7), seed=5)
        found = recover_elasticity(given.matrix)
        assert list(found.cells) == [KIND[kind]]
        assert {frozenset(c) for c in only(found)[:, :4].tolist()} == corners_of(given)


@pytest.mark.parametrize("kind", CURVED)
@pytest.mark.parametrize("suffix", [".vtu", ".msh"])
def test_files_are_read_by_others(kind, suffix, tmp_path):
    """scikit-fem reads the file, with its own order of nodes, and assembles the matrix that was given."""
    given = stiffness(kind, mesh(kind), lam=1.5, intorder=4)
    found = recover(given.matrix)
    found.save(tmp_path / f"cells{suffix}")
    read = skfem.Mesh.load(tmp_path / f"cells{suffix}")
    again = stiffness(kind, read, lam=1.5, intorder=4)
    same = cKDTree(again.points).query(found.points[:, : again.dim])[1]
    rows = (same[:, None] * again.dim + np.arange(again.dim)).ravel()
    factor = again.matrix.diagonal().sum() / given.matrix.diagonal().sum()
    assert abs(again.matrix[rows][:, rows] - factor * given.matrix).max() < 1e-10 * abs(again.matrix).max()


def test_corners_of_distorted_hexahedra_are_put_in_order():
    shape = box("hex-q1", (11, 11, 11), perturb=0.2)
    cells = shape.t.T
    cube = ordered_boxes(np.sort(cells, axis=1), shape.p.T)
    # scikit-fem's corners as meshio orders them
    expected = cells[:, [0, 3, 6, 2, 1, 5, 7, 4]]
    edges = [list(pair) for pair in KINDS["hexahedron20"].between]
    mine, true = (np.sort(np.sort(some[:, edges], axis=2) @ [10**6, 1], axis=1) for some in (cube, expected))
    assert np.array_equal(mine, true)
    slopes = shape.p.T[cube[:, [1, 3, 4]]] - shape.p.T[cube[:, :1]]
    assert np.median(np.linalg.det(slopes)) > 0


def test_cliques_that_are_no_cells_are_told_apart():
    """Three tetrahedra around an edge make up two larger ones; two of these are cliques as well."""
    points = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [-0.5, 0.8, 0], [-0.5, -0.8, 0.1]], dtype=float)
    cells = np.array([[0, 1, 2, 3], [0, 1, 3, 4], [0, 1, 4, 2]])
    given = stiffness("tet-p1", skfem.MeshTet(points.T.copy(), cells.T.copy()))
    for material in ({}, {"lam": lambda x: 1 + (x[0] > 0) + 0 * x[0]}):
        given = stiffness("tet-p1", skfem.MeshTet(points.T.copy(), cells.T.copy()), **material)
        found = recover_elasticity(given.matrix)
        assert {frozenset(cell) for cell in only(found).tolist()} == {frozenset(cell) for cell in cells.tolist()}
