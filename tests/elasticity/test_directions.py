"""Directions of rows: right, or said to be unknown."""

import numpy as np
import pytest
from assembled import box, permuted_nodes, stiffness
from supported import assert_certified, given, judged

from unassemble.elasticity import recover_elasticity
from unassemble.elasticity.rows.constants import proven_directions, uncoupled_rows
from unassemble.elasticity.rows.grouping import same_pattern
from unassemble.elasticity.unknowns import find_numbering


def near_incompressible(kind, nu):
    mesh = box(kind, (5, 5, 6) if kind == "hex-q1" else (3, 4, 4))
    return given(
        permuted_nodes(stiffness(kind, mesh, lam=2 * nu / (1 - 2 * nu)), 1), "symmetry", "interleaved", "stored"
    )


@pytest.mark.parametrize("nu", [0.499, 0.4999])
def test_symmetry_planes_of_near_incompressible_material(nu):
    """Directions of least energy are wrong there: only those change no volume that move all neighbours together."""
    case = near_incompressible("hex-q1", nu)
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-10
    assert truth.missing == truth.split == 0
    assert found.poisson_ratio == pytest.approx(nu, abs=1e-9)


def test_least_sums_tell_directions_along_edges_of_near_incompressible_bodies():
    """Where planes meet no single row tells them, and both energy and equilibrium have wrong ones there."""
    case = near_incompressible("hex-s2", 0.499)
    assert (find_numbering(case.matrix).direction_of_row == case.direction).all()
    assert_certified(case, 1e-9, 0.03, split=0)  # without those next to the corner


def test_least_sums_are_taken_where_no_direction_is_proven_by_them_either():
    mesh = box("tet-p2", (3, 4, 4), perturb=0.2, seed=39)
    body = permuted_nodes(stiffness("tet-p2", mesh, lam=499.0), seed=39)
    case = given(body, "symmetry", "boundary first", "stored")
    assert_certified(case, 1e-9, 0.1, split=0)  # without those next to the corner


def test_sums_that_vanish_by_mirror_symmetry_prove_nothing():
    """Around a node in its own mirror image entries between two directions cancel, whatever is missing."""
    case = near_incompressible("hex-s2", 0.499)
    found = find_numbering(case.matrix)
    wrong = found.direction_of_row != case.direction
    assert not (wrong & ~found.unnamed).any()
    group = same_pattern(case.matrix, uncoupled_rows(case.matrix))
    on_axis = np.bincount(group)[group] == 1  # single rows of nodes where two planes meet
    assert on_axis.any()
    exchanged = np.where(on_axis, (case.direction + 1) % 3, case.direction)
    assert not (proven_directions(case.matrix, exchanged, group, 3) & on_axis).any()


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
    modes = found.rigid_body_modes()
    expected = (truth.direction[:, None] == np.arange(3)) & told[:, None]
    assert np.array_equal(modes[live, :3], expected[live])
    assert not modes[~told].any()
