"""Unknowns taken out one by one, in the orders that codes write, with zeros stored or dropped."""

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import box, error, heterogeneous, on_plane, permuted_nodes, recover_elasticity, stiffness
from supported import assert_certified, given, judged

from unassemble.errors import RecoveryError
from unassemble.nodes import find_numbering

COUNTS = {"tri-p1": (8, 9), "tri-p2": (6, 7), "quad-q1": (8, 9), "tet-p1": (4, 5, 5)}


def varying_shear(x):
    return 1 + x[1] + x[0] * x[1]


def body(kind, perturb=0.0, permuted=True, **material):
    material = material or {"lam": heterogeneous, "mu": varying_shear}
    case = stiffness(kind, box(kind, COUNTS[kind], perturb=perturb), **material)
    return permuted_nodes(case, seed=1) if permuted else case


@pytest.mark.parametrize("zeros", ["stored", "dropped"])
@pytest.mark.parametrize("order", ["interleaved", "by component"])
@pytest.mark.parametrize("support", ["roller", "symmetry"])
@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1", "tet-p1"])
def test_structured_meshes_of_linear_elements(kind, support, order, zeros):
    """Varying Poisson's ratio as well: nodes on the plane are placed because it is a plane."""
    case = given(body(kind), support, order, zeros)
    assert_certified(case, 1e-10, 0.0)


@pytest.mark.parametrize("support", ["clamp", "roller", "symmetry", "identity rollers", "several"])
def test_large_bodies_lose_no_node(support):
    """Planes are asked at once: the fields that are free without them would cost most of the time."""
    mesh = box("tet-p1", (13, 14, 14), perturb=0.2)
    whole = permuted_nodes(stiffness("tet-p1", mesh, lam=heterogeneous, mu=varying_shear), seed=1)
    assert_certified(given(whole, support, "interleaved", "stored"), 1e-8, 0.0)


@pytest.mark.parametrize("order", ["interleaved", "by component"])
@pytest.mark.parametrize("permuted", [False, True])
def test_quadratic_triangles_with_dropped_zeros(order, permuted):
    case = given(body("tri-p2", permuted=permuted), "roller", order, "dropped")
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert truth.error < 1e-9
    assert truth.missing == 0


def test_quadratic_triangles_lose_nothing_at_a_roller():
    case = given(body("tri-p2"), "roller", "interleaved", "stored")
    found = recover_elasticity(case.matrix)
    assert found.certified
    assert not found.node_status.any()
    assert judged(found, case).error < 1e-9
    assert any("planes" in one for one in found.warnings)


@pytest.mark.parametrize("kind", ["tri-p2", "quad-s2"])
def test_quadratic_elements_lose_little_where_symmetry_planes_meet(kind):
    """In the plane some nodes stay loose next to the corner; they are set aside, and the others are unique."""
    whole = stiffness(kind, box(kind, COUNTS["tri-p2"]), lam=heterogeneous, mu=varying_shear)
    case = given(permuted_nodes(whole, seed=1), "identity rollers", "interleaved", "stored")
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-9
    assert 0 < truth.missing < 0.06
    assert any("no equation that holds for every element" in one for one in found.warnings)


@pytest.mark.parametrize("kind", ["tri-p1", "tri-p2", "quad-q1"])
def test_homogeneous_body_held_all_around(kind):
    """Clamped, on rollers, and by penalties, behind which the free boundary shows: it fixes what the inside leaves."""
    case = given(body(kind, perturb=0.2, lam=1.5, mu=1.0), "several", "interleaved", "stored")
    assert_certified(case, 1e-9, 0.4 if kind == "tri-p2" else 0.33)


@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1"])
def test_penalties_do_not_hide_what_was_eliminated_behind_them(kind):
    """What rows with a penalty lack of regular meshes adds up to zero in the others of their nodes."""
    whole = body(kind, lam=1.5, mu=1.0)
    low, next_to_it = on_plane(whole, 1), on_plane(whole, 1, 1 / (COUNTS[kind][1] - 1))
    penalty = sp.diags_array(1e10 * np.repeat(next_to_it, 2))
    rows = np.flatnonzero(~np.repeat(low, 2))
    found = recover_elasticity(sp.csr_array((whole.matrix + penalty).tocsr()[rows][:, rows]))
    assert found.certified
    assert not found.node_status.any()
    assert error(found.points, whole.points[~low]) < 1e-10


def test_directions_held_elsewhere_than_on_a_plane_across_them_are_not_believed():
    """x is taken out of nodes on y = 0, no plane across x: these stay without coordinates, the others are right."""
    whole = body("tri-p1", perturb=0.2)
    gone = np.zeros(whole.points.shape, dtype=bool)
    gone[np.abs(whole.points[:, 1]) < 1e-9, 0] = True
    keep = sp.diags_array((~gone.ravel()).astype(float))
    matrix = sp.csr_array(keep @ whole.matrix @ keep + sp.diags_array(gone.ravel().astype(float)))
    found = recover_elasticity(matrix)
    truth = given(whole, "free", "interleaved", "dropped")
    assert found.certified
    assert np.array_equal(found.node_status == 1, gone.any(axis=1))
    assert judged(found, truth).error < 1e-10


def test_large_matrix_that_is_none_is_refused_without_a_search():
    n = 28
    line = sp.diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    one = sp.eye_array(n)
    laplace = sum(sp.kron(sp.kron(a, b), c) for a, b, c in ((line, one, one), (one, line, one), (one, one, line)))
    with pytest.raises(RecoveryError, match="no numbering"):
        find_numbering(sp.csr_array(laplace))


@pytest.mark.parametrize(("kind", "counts"), [("quad-q1", (6, 7)), ("tet-p1", (4, 5, 4)), ("hex-q1", (4, 5, 4))])
@pytest.mark.parametrize("support", ["roller", "penalty clamp"])
def test_cells_next_to_rollers_and_penalties_re_assemble(kind, counts, support):
    """No node is gone there, so that every entry that is left is the sum over cells that are all there."""
    mesh = box(kind, counts, perturb=0.2)
    case = given(permuted_nodes(stiffness(kind, mesh, lam=1.5, mu=1.0), seed=1), support, "interleaved", "stored")
    found = recover_elasticity(case.matrix)
    assert found.certified
    assert found.n_cells == len(found.lame) == mesh.nelements
    assert np.ptp(found.lame[:, 0] / found.lame[:, 1]) < 1e-9


@pytest.mark.parametrize("support", ["roller", "symmetry"])
def test_rows_that_look_little_alike_but_stand_in_order(support):
    """Zeros dropped: at edges of the body rows of one node reach different rows, but each is the other's likest."""
    whole = permuted_nodes(stiffness("tet-p1", box("tet-p1", (5, 5, 5), perturb=0.2), lam=1.5, mu=1.0), seed=1)
    case = given(whole, support, "interleaved", "dropped")
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-10
    assert truth.missing == truth.split == 0


@pytest.mark.parametrize(
    ("support", "order"),
    [("symmetry", "by component"), ("identity rollers", "interleaved"), ("symmetry", "interleaved")],
)
def test_cells_with_nodes_all_of_whose_entries_were_taken_out(support, order):
    """Where zeros are dropped, two nodes on rollers may have no entry left, though they belong to one tetrahedron."""
    body = permuted_nodes(stiffness("tet-p2", box("tet-p2", (3, 4, 4)), lam=1.5), seed=1)
    case = given(body, support, order, "dropped")
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-12
    assert truth.split == 0
    assert truth.missing < 0.12  # those next to the corner, which is not in the matrix
