"""Every kind of support, every numbering."""

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import (
    ELEMENTS,
    box,
    eliminated,
    error,
    heterogeneous,
    on_plane,
    permuted_nodes,
    recover_elasticity,
    stiffness,
    with_identity,
    with_penalty,
)  # fmt: skip
from supported import with_zeros

from unassemble.errors import RecoveryError
from unassemble.nodes import find_numbering, given_numbering

KINDS = {"tri-p1": (8, 9), "quad-q1": (8, 9), "tet-p1": (5, 6, 7), "hex-q1": (5, 6, 7)}


def body(kind, **material):
    return permuted_nodes(stiffness(kind, box(kind, KINDS[kind], perturb=0.2), **material), seed=2)


def held(given, planes):
    """Rollers on planes across some axes."""
    gone = np.zeros(given.points.shape, dtype=bool)
    for axis in planes:
        gone[on_plane(given, axis), axis] = True
    return gone


@pytest.mark.parametrize("kind", KINDS)
def test_penalty_loses_nothing(kind):
    given = body(kind)
    for planes in ([0], range(given.dim)):
        found = recover_elasticity(with_penalty(given, held(given, planes)))
        assert found.certified
        assert not found.node_status.any()
        assert error(found.points, given.points) < 1e-10


@pytest.mark.parametrize("kind", KINDS)
def test_identity_rows(kind):
    given = body(kind)
    gone = np.repeat(on_plane(given, 0)[:, None], given.dim, axis=1)
    found = recover_elasticity(with_identity(given, gone))
    assert found.certified
    assert np.array_equal(found.node_status == 1, gone.all(axis=1))
    assert np.isnan(found.points[gone.all(axis=1)]).all()
    assert error(found.points, given.points) < 1e-10


@pytest.mark.parametrize("kind", ["tet-p1", "hex-q1"])
@pytest.mark.parametrize("planes", [(0,), (0, 1), (0, 1, 2)])
def test_rollers_in_space(kind, planes):
    """Directions eliminated one by one; Poisson's ratio, where it is one number, places the nodes on the planes."""
    given = body(kind)
    numbering = with_identity(given, held(given, planes))
    found = recover_elasticity(numbering)
    assert found.certified
    assert found.node_status.sum() <= 1  # the corner that three planes hold
    assert error(found.points, given.points) < 1e-10


@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1"])
def test_rollers_in_the_plane_hide_what_they_hold(kind):
    """In the plane a row that lost one direction has as many unknown boundary terms as equations."""
    given = body(kind, lam=heterogeneous)
    gone = held(given, [0])
    found = recover_elasticity(with_identity(given, gone))
    assert found.certified
    assert not found.node_status[~gone.any(axis=1)].any()
    assert error(found.points, given.points) < 1e-10


@pytest.mark.parametrize("order", ["interleaved", "by component", "nodes at random", "rows at random"])
@pytest.mark.parametrize("kind", KINDS)
def test_numbering(kind, order):
    given = body(kind)
    n, d = given.points.shape
    rng = np.random.default_rng(4)
    rows = {
        "interleaved": np.arange(n * d),
        "by component": np.arange(n * d).reshape(n, d).T.ravel(),
        "nodes at random": (rng.permutation(n)[:, None] * d + np.arange(d)).ravel(),
        "rows at random": rng.permutation(n * d),
    }[order]
    matrix = with_zeros(given.matrix, d, "stored")[rows][:, rows]
    found = find_numbering(matrix)
    assert found.block_size == d
    pairs = np.unique(np.column_stack([found.node_of_row, rows // d]), axis=0)
    assert len(pairs) == n
    axes = np.unique(np.column_stack([found.direction_of_row, rows % d]), axis=0)
    assert len(axes) == d  # a bijection; which axis is called first no pattern can tell
    if order != "rows at random":
        assert np.array_equal(axes[:, 0], axes[:, 1])
    recovered = recover_elasticity(matrix)
    truth = np.empty_like(given.points)
    truth[recovered.node_of_row] = given.points[rows // d]
    assert error(recovered.points[:, axes[np.argsort(axes[:, 1]), 0]], truth) < 1e-10


@pytest.mark.parametrize("kind", ["quad-q1", "hex-q1"])
@pytest.mark.parametrize("order", ["interleaved", "by component"])
def test_rollers_eliminated(kind, order):
    """Rows are missing here and there, so that no stride fits; pattern and numbers find nodes and directions."""
    given = body(kind)
    d = given.dim
    rows = np.flatnonzero(~held(given, [0, 1]).ravel())
    if order == "by component":
        rows = rows[np.argsort(rows % d, kind="stable")]
    found = recover_elasticity(given.matrix[rows][:, rows])
    assert found.certified
    assert np.array_equal(found.direction_of_row, rows % d)
    truth = np.empty((len(found.points), d))
    truth[found.node_of_row] = given.points[rows // d]
    assert error(found.points, truth) < 1e-10


def wing():
    """Thin and graded: where cells are flat, entries hardly tell directions apart."""
    mesh = ELEMENTS["tri-p1"][0].init_tensor(np.linspace(0, 1, 41), np.linspace(-1, 1, 9))
    x, y = mesh.p
    thickness = 0.19 * (1.1 - x) * np.sqrt(x + 0.02)
    return stiffness("tri-p1", type(mesh)(np.stack([x, 0.1 * np.sin(np.pi * x) + thickness * y]), mesh.t))


def test_regions_that_were_labelled_from_different_sides_are_reconciled():
    given = wing()
    rows = np.random.default_rng(0).permutation(2 * len(given.points))
    found = recover_elasticity(given.matrix[rows][:, rows])
    assert found.certified
    assert len(found.evidence) == 1
    assert found.n_cells == len(given.cells)
    assert len(np.unique(np.column_stack([found.direction_of_row, rows % 2]), axis=0)) == 2


def test_given_numbering_is_used():
    given = body("tet-p1")
    d = given.dim
    rows = np.flatnonzero(~held(given, [0, 1]).ravel())
    matrix = given.matrix[rows][:, rows]
    found = recover_elasticity(matrix, numbering=given_numbering(matrix, rows // d, rows % d))
    truth = np.empty((len(found.points), d))
    truth[found.node_of_row] = given.points[rows // d]
    assert found.certified
    assert error(found.points, truth) < 1e-10


@pytest.mark.parametrize("factor", [1e-8, -3.0, 2e11])
def test_scaled_by_a_constant(factor):
    given = body("tet-p1")
    found = recover_elasticity(given.matrix * factor)
    assert found.certified
    assert error(found.points, given.points) < 1e-10


def test_two_bodies():
    one, other = body("tri-p1"), stiffness("tri-p1", box("tri-p1", (5, 4)))
    found = recover_elasticity(sp.block_diag([one.matrix, other.matrix], format="csr"))
    assert found.certified
    assert len(found.evidence) == 2
    for piece, truth in enumerate((one.points, other.points)):
        assert error(found.points[found.component == piece], truth) < 1e-10


def test_matrix_that_is_not_elasticity():
    rng = np.random.default_rng(0)
    noise = sp.random_array((60, 60), density=0.1, rng=rng)
    with pytest.raises(RecoveryError):
        recover_elasticity(sp.csr_array(noise + noise.T + 10 * sp.eye_array(60)))


def test_nodes_taken_away_do_not_pass_for_a_direction_taken_away():
    """Next to a row of clamped nodes entries of the direction along it add up to zero, and the others do not."""
    given = stiffness("tet-p1", box("tet-p1", (3, 5, 6)))
    gone = on_plane(given, 0) | (on_plane(given, 2) & on_plane(given, 0, 0.5))
    matrix, nodes = eliminated(given, np.repeat(gone[:, None], 3, axis=1))
    rows = np.random.default_rng(0).permutation(matrix.shape[0])
    matrix = sp.csr_array(matrix[rows][:, rows])
    found = recover_elasticity(matrix, numbering=given_numbering(matrix, rows // 3, rows % 3))
    points = np.empty((len(nodes), 3))
    points[found.node_of_row] = given.points[nodes][rows // 3]
    assert found.certified
    assert error(found.points, points) < 1e-10
    assert found.node_status.mean() < 0.2
