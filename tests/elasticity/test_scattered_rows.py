"""Rows in random order: directions spread by translations in equilibrium, nodes told by where their rows lie."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import box, heterogeneous, permuted_nodes, stiffness
from supported import assert_certified, given, judged

from unassemble.elasticity import recover_elasticity
from unassemble.elasticity.directions.extension import extended_directions
from unassemble.elasticity.nodal import eliminated, nodal_matrix
from unassemble.elasticity.rows.constants import uncoupled_rows
from unassemble.elasticity.rows.grouping import same_pattern
from unassemble.elasticity.scattered.row_positions import placed_together, single_nodes
from unassemble.elasticity.scattered.scattered import scattered
from unassemble.elasticity.unknowns import given_numbering


def quadratic(kind, support, order="at random", counts=(3, 3, 4)):
    mesh = box(kind, counts, perturb=0.2)
    body = permuted_nodes(stiffness(kind, mesh, lam=heterogeneous, mu=lambda x: 1 + x[1] + x[0] * x[1]), seed=1)
    return given(body, support, order, "stored")


def agreement(direction, truth):
    """Whether directions are right up to the names of the axes."""
    pairs = np.unique(np.column_stack([direction, truth]), axis=0)
    return len(pairs) == truth.max() + 1


@pytest.mark.parametrize("support", ["free", "clamp", "penalty clamp"])
def test_translations_in_equilibrium_tell_directions(support):
    case = quadratic("hex-s2", support, counts=(3, 4, 4))
    live = ~uncoupled_rows(case.matrix)
    group = same_pattern(case.matrix, ~live)
    direction, share = extended_directions(case.matrix, group, live, 3)
    assert share == 1
    assert agreement(direction, case.direction) or support == "clamp"  # rows that nothing vouches for may be wrong


def test_the_pieces_of_a_body_are_read_one_by_one():
    one = quadratic("tet-p2", "free")
    two = sp.csr_array(sp.block_diag([one.matrix, one.matrix]))
    direction, share = extended_directions(
        two, same_pattern(two, np.zeros(two.shape[0], dtype=bool)), np.ones(two.shape[0], dtype=bool), 3
    )
    half = len(one.node)
    assert share == 1
    assert agreement(direction[:half], one.direction)
    assert agreement(direction[half:], one.direction)


def test_rows_of_one_pattern_are_joined_where_they_coincide():
    case = quadratic("hex-s2", "free")
    group = same_pattern(case.matrix, np.zeros(len(case.node), dtype=bool))
    start = single_nodes(group, case.direction, 3)
    assert start.max() + 1 > 1.5 * len(case.points)
    everywhere = np.ones(len(case.node), dtype=bool)
    node, open_row = placed_together(case.matrix, everywhere, group, start, case.direction, 3)
    assert not open_row.any()
    assert len(np.unique(np.column_stack([node, case.node]), axis=0)) == node.max() + 1 == len(case.points)


@pytest.mark.parametrize(("kind", "support", "missing"), [("hex-s2", "free", 0), ("tet-p2", "clamp", 0.3)])
def test_quadratic_solids_come_back_with_rows_at_random(kind, support, missing):
    case = quadratic(kind, support)
    assert_certified(case, 1e-10, missing, split=0)


@pytest.mark.parametrize(
    ("support", "perturb", "counts", "missing"),
    [("roller", 0.2, (3, 3, 4), 0.0), ("symmetry", 0.0, (4, 4, 4), 0.03), ("symmetry", 0.2, (4, 4, 4), 0.2)],
)
def test_halves_do_not_pass_for_nodes_that_lack_a_direction(support, perturb, counts, missing):
    """Most rows next to a support have no position of their own; what their fellows lack is counted by pattern."""
    body = permuted_nodes(stiffness("hex-s2", box("hex-s2", counts, perturb=perturb), lam=1.5), seed=1)
    case = given(body, support, "at random", "stored")
    assert_certified(case, 1e-10, missing, split=0)


def test_what_a_pattern_lacks_is_counted():
    """Three rows each of y and z, two of x: one of the three nodes lacks x, so that all that touch them may miss it."""
    direction = np.array([0, 0, 1, 1, 1, 2, 2, 2])
    present = np.arange(8)[:, None] * (np.arange(3) == direction[:, None]) - (np.arange(3) != direction[:, None])
    matrix = np.ones((8, 8))  # no row adds up to zero, so that no direction is missed without a trace
    one = nodal_matrix(sp.csr_array(matrix), given_numbering(sp.csr_array(matrix), np.arange(8), direction))
    assert (eliminated(one) == (present < 0)).all()
    fellows = replace(one, fellows=np.zeros(8, np.int64))
    assert (eliminated(fellows) == ((present < 0) & (np.arange(3) == 0))).all()


def test_rows_in_order_are_left_to_their_order():
    assert scattered(quadratic("hex-s2", "roller", "interleaved").matrix, (3, 2)) is None


@pytest.mark.parametrize("support", ["roller", "symmetry"])
def test_where_zeros_were_dropped_patterns_do_not_show_nodes(support):
    """At a corner the rows of one node reach different ones; the half of it is no node on a plane."""
    body = permuted_nodes(stiffness("tri-p2", box("tri-p2", (6, 7), perturb=0.2), lam=1.5), seed=1)
    case = given(body, support, "at random", "dropped")
    assert scattered(case.matrix, (3, 2)) is None
    assert judged(recover_elasticity(case.matrix), case).error < 1e-9


def test_two_directions_of_three_are_not_taken_for_one():
    """Sums over both vanish as well."""
    mesh = box("hex-q1", (4, 5, 4))
    body = permuted_nodes(stiffness("hex-q1", mesh, lam=heterogeneous, mu=lambda x: 1 + x[1] + x[0] * x[1]), seed=1)
    assert scattered(given(body, "roller", "at random", "stored").matrix, (2,)) is None
