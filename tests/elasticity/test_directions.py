"""Directions of rows: right, or said to be unknown."""

import numpy as np
import pytest
from assembled import box, permuted_nodes, recover_elasticity, stiffness
from supported import assert_certified, given, judged

from unassemble.modes import rigid_body_modes


@pytest.mark.parametrize("nu", [0.499, 0.4999])
def test_symmetry_planes_of_near_incompressible_material(nu):
    """Directions of least energy are wrong there: only those change no volume that move all neighbours together."""
    body = permuted_nodes(stiffness("hex-q1", box("hex-q1", (5, 5, 6)), lam=2 * nu / (1 - 2 * nu)), seed=1)
    case = given(body, "symmetry", "interleaved", "stored")
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-10
    assert truth.missing == truth.split == 0
    assert found.poisson_ratio == pytest.approx(nu, abs=1e-9)


def test_least_sums_are_taken_where_no_direction_is_proven_by_them_either():
    mesh = box("tet-p2", (3, 4, 4), perturb=0.2, seed=39)
    body = permuted_nodes(stiffness("tet-p2", mesh, lam=499.0), seed=39)
    case = given(body, "symmetry", "boundary first", "stored")
    assert_certified(case, 1e-9, 0.1, split=0)  # without those next to the corner


@pytest.mark.parametrize(
    ("kind", "counts", "order"),
    [
        ("hex-s2", (4, 5, 5), "by component"),
        ("tet-p2", (3, 4, 4), "interleaved"),
        ("quad-q2", (6, 7), "interleaved"),
    ],
)
def test_quadratic_near_incompressible_elements(kind, counts, order):
    lam = 2 * 0.499 / (1 - 2 * 0.499)
    body = permuted_nodes(stiffness(kind, box(kind, counts, perturb=0.1), lam=lam), seed=1)
    assert_certified(given(body, "symmetry", order, "stored"), 1e-9, 0.31, split=0)


@pytest.mark.parametrize(("support", "seed"), [("symmetry", 0), ("several", 1)])
def test_rows_of_nodes_without_coordinates(support, seed):
    """In structured meshes sums over wrong directions vanish, too."""
    case = permuted_nodes(stiffness("hex-s2", box("hex-s2", (4, 4, 4)), lam=1.5), seed)
    truth = given(case, support, "interleaved", "stored", seed)
    found = recover_elasticity(truth.matrix)
    told = found.direction_of_row >= 0
    live = abs(truth.matrix).sum(axis=1) > np.abs(truth.matrix.diagonal())
    placed = np.isfinite(found.points).all(axis=1)[found.node_of_row]
    assert found.certified
    assert told[placed].all()
    assert (found.direction_of_row == truth.direction)[told & live].all()
    assert told[placed].mean() > 0.9
    assert told.all() or any("not proven" in warning for warning in found.warnings)
    modes = rigid_body_modes(found.points, found.node_of_row, found.direction_of_row)
    expected = (truth.direction[:, None] == np.arange(3)) & told[:, None]
    assert np.array_equal(modes[live, :3], expected[live])
    assert not modes[~told].any()
