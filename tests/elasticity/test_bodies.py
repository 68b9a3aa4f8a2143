"""Bodies that are no boxes, supported as engineers support them, through the public door."""

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from assembled import ELEMENTS, box, error, on_plane, permuted_nodes, stiffness
from supported import given, judged

import unassemble
from unassemble.errors import NotPlanarError


def hollow_cylinder(kind, perturb=0.0, counts=(5, 9, 9)):
    """An eighth of a thick pipe: its planes of symmetry are x = 0, y = 0 and z = 0."""
    mesh_type = ELEMENTS[kind][0]
    mesh = mesh_type.init_tensor(*(np.linspace(0, 1, k) for k in counts))
    p = mesh.p.copy()
    inner = np.all((p > 1e-9) & (p < 1 - 1e-9), axis=0)
    p[:, inner] += perturb / (max(counts) - 1) * np.random.default_rng(0).uniform(-1, 1, (3, inner.sum()))
    radius, angle = 1 + p[0] / 2, np.pi / 2 * p[1]
    place = np.stack([radius * np.cos(angle), radius * np.sin(angle), 2 * p[2]])
    place[np.abs(place) < 1e-12] = 0
    return mesh_type(place, mesh.t)


@pytest.mark.parametrize("order", ["interleaved", "by component", "at random"])
@pytest.mark.parametrize(("kind", "perturb"), [("hex-q1", 0.0), ("hex-q1", 0.2), ("tet-p1", 0.0)])
def test_symmetry_planes_of_a_pipe(kind, perturb, order):
    """Rows at the edges in which planes meet prove no direction; a wrong one moves the nodes around it."""
    case = given(permuted_nodes(stiffness(kind, hollow_cylinder(kind, perturb), lam=1.5)), "symmetry", order, "stored")
    found = unassemble.recover(case.matrix)
    truth = judged(found, case)
    assert found.status == "certified"
    assert truth.error < 1e-11
    assert truth.missing == 0


@pytest.mark.slow
@pytest.mark.parametrize("order", ["interleaved", "by component"])
@pytest.mark.parametrize("numbered", ["by the mesh", "at random"])
@pytest.mark.parametrize("mu", [1.0, lambda x: 1 + x[1] + x[0] * x[1]])
def test_symmetry_planes_of_a_pipe_of_curved_hexahedra(mu, numbered, order):
    """Node by node, rows at edges in which planes meet take the directions in which translations are in equilibrium.

    Component by component some nodes that couple to the same unknowns lack rows, and order does not tell which of them.
    """
    case = stiffness("hex-s2", hollow_cylinder("hex-s2", counts=(3, 6, 5)), lam=1.5, mu=mu)
    if numbered == "at random":
        case = permuted_nodes(case)
    case = given(case, "symmetry", order, "stored")
    found = unassemble.recover(case.matrix)
    truth = judged(found, case)
    assert found.status == "certified"
    assert truth.error < 1e-11
    assert truth.missing <= (0.16 if order == "by component" else 0)
    assert truth.split == 0


def with_mass(kind, mesh, factor):
    """K plus a multiple of the consistent mass matrix, and the points, node by node."""
    case = stiffness(kind, mesh, lam=1.5)
    basis = skfem.Basis(mesh, ELEMENTS[kind][1]())
    mass = skfem.BilinearForm(lambda u, v, w: u * v).assemble(basis).tocsr()
    groups = (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs)
    dofs = np.concatenate([some for some in groups if some is not None and some.size], axis=1)[0]
    mass = sp.kron(mass[dofs][:, dofs], np.eye(case.dim))
    size = factor * abs(case.matrix).max() / abs(mass).max()
    return sp.csr_array(case.matrix + size * mass), case.points


@pytest.mark.parametrize("order", ["interleaved", "by component", "at random"])
def test_mass_added_is_said(order):
    matrix, points = with_mass("hex-q1", box("hex-q1", (6, 5, 5), perturb=0.2), 1e-3)
    rows = np.arange(matrix.shape[0])
    if order == "by component":
        rows = rows.reshape(-1, 3).T.ravel()
    elif order == "at random":
        rows = np.random.default_rng(0).permutation(rows)
    with pytest.raises(NotPlanarError, match=f"{len(points)} nodes with 3 unknowns.*mass matrix"):
        unassemble.recover(matrix[rows][:, rows])


def test_entries_at_the_threshold_of_rounding():
    """Some entries are as small as what counts as zero in a row, and not so in its column's."""
    for factor in (1e-14, 1e-13, 1e-12, 1e-11):
        matrix, points = with_mass("tri-p2", box("tri-p2", (8, 9), perturb=0.1), factor)
        found = unassemble.recover(matrix)
        assert error(found.points, points) < 20 * factor + 1e-11


def inclined(case, nodes, angle):
    """The same matrix with the unknowns of some nodes along other axes."""
    c, s = np.cos(angle), np.sin(angle)
    turn = sp.block_diag([[[c, -s], [s, c]] if one else np.eye(2) for one in nodes], format="csr")
    return sp.csr_array(turn.T @ case.matrix @ turn)


@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1", "quad-s2"])
def test_nodes_with_other_axes(kind):
    """A few of them get no coordinates; halves of a body are not taken for one."""
    case = permuted_nodes(stiffness(kind, box(kind, (9, 10), perturb=0.2), lam=1.5))
    face = on_plane(case, 0, 1.0)
    found = unassemble.recover(inclined(case, face, 0.4))
    assert found.status == "certified"
    assert (found.node_status[face] == 1).all()
    assert error(found.points, case.points) < 1e-11
    found = unassemble.recover(inclined(case, case.points[:, 0] > 0.5, 0.4))
    assert found.status == "uncertified"
    assert "other axes" in found.reason


def test_fields_of_loose_nodes_that_die_out():
    """Sliding along a plane that it may leave: nodes there stay loose, and move those behind them less and less."""
    case = stiffness("tri-p2", box("tri-p2", (8, 9), perturb=0.1), lam=1.5)
    gone = np.zeros(case.points.shape, dtype=bool)
    gone[on_plane(case, 0), 1] = True
    rows = np.flatnonzero(~gone.ravel())
    found = unassemble.recover(case.matrix[rows][:, rows])
    assert found.status == "certified"
    assert found.node_status.any()
    assert error(found.points, case.points) < 1e-8


def test_tied_nodes_are_not_certified():
    """Opposite faces tied together, as for periodic boundaries."""
    case = stiffness("quad-q1", box("quad-q1", (9, 10), perturb=0.2), lam=1.5)
    first, last = (np.flatnonzero(on_plane(case, 0, x)) for x in (0.0, 1.0))
    first, last = (some[np.argsort(case.points[some, 1])] for some in (first, last))
    node = np.arange(len(case.points))
    node[last] = first
    node = np.unique(node, return_inverse=True)[1]
    unknown = (2 * node[:, None] + np.arange(2)).ravel()
    tie = sp.csr_array((np.ones(len(unknown)), (np.arange(len(unknown)), unknown)))
    found = unassemble.recover(sp.csr_array(tie.T @ case.matrix @ tie))
    assert found.status == "uncertified"
    assert "tied together" in found.reason


@pytest.mark.parametrize("factor", [1e-60, -1e60])
@pytest.mark.parametrize("kind", ["quad-s2", "hex-q1"])
def test_units_of_any_size(kind, factor):
    """The Lame coefficients come back in them; they go with the size of the body, which is free in space."""
    case = stiffness(kind, box(kind, (5, 4) if kind == "quad-s2" else (4, 4, 4), perturb=0.2), lam=1.5)
    found, plain = (unassemble.recover(sp.csr_array(one * case.matrix)) for one in (factor, 1.0))
    assert found.status == "certified"
    assert np.allclose(found.lame, factor * plain.lame, rtol=1e-8, atol=0)
    assert error(found.points, case.points) < 1e-11


def test_symmetry_planes_of_a_graded_body():
    """Directions there are not those of least energy, which a look at a few rows would ask for."""
    case = stiffness("hex-q1", box("hex-q1", (6, 5, 5), grading=3.0), lam=1.5)
    case = given(permuted_nodes(case), "symmetry", "interleaved", "stored")
    found = unassemble.recover(case.matrix)
    truth = judged(found, case)
    assert found.status == "certified"
    assert truth.error < 1e-11
    assert truth.missing == 0
