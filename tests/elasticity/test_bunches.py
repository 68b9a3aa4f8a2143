"""Rows at random whose zeros were dropped: nodes from likeness alone, directions from nodes."""

import numpy as np
import pytest
from assembled import box, heterogeneous, permuted_nodes, stiffness
from supported import assert_certified, given, judged

from unassemble.elasticity import recover_elasticity
from unassemble.elasticity.rows.constants import uncoupled_rows, whole_share
from unassemble.elasticity.rows.likeness import next_to_likest, reach
from unassemble.elasticity.scattered.bunches import bunched
from unassemble.elasticity.scattered.searching import searched

COUNTS = {"tri-p1": (8, 9), "quad-q1": (8, 9), "tet-p1": (4, 5, 5), "hex-q1": (5, 6, 5)}


def held(kind, support, order="at random", seed=0, **material):
    whole = stiffness(kind, box(kind, COUNTS[kind]), **(material or {"lam": 1.5, "mu": 1.0}))
    return given(permuted_nodes(whole, seed=1), support, order, "dropped", seed=seed)


@pytest.mark.parametrize("kind", COUNTS)
def test_rows_of_one_node_are_likest_each_other(kind):
    case = held(kind, "free")
    node = bunched(case.matrix, case.direction.max() + 1)
    assert len(np.unique(np.column_stack([node, case.node]), axis=0)) == node.max() + 1 == len(case.points)


@pytest.mark.parametrize(
    ("kind", "support"),
    [("tet-p1", "roller"), ("tet-p1", "penalty clamp"), ("tet-p1", "several"), ("hex-q1", "free"), ("hex-q1", "clamp")],
)
def test_structured_bodies_of_one_material(kind, support):
    """Many sums vanish by symmetry whatever the directions; those of whole nodes leave little choice."""
    case = held(kind, support)
    assert_certified(case, 1e-9, 0.06)


@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1", "tet-p1"])
def test_where_symmetry_planes_meet_nothing_wrong_is_certified(kind):
    """Rows that stand alone there are likest those of the next node on the same edge."""
    case = held(kind, "symmetry")
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert truth.error < 1e-9
    assert truth.missing < 0.05


def test_the_search_ends_with_directions_for_which_all_whole_rows_add_up():
    case = held("tet-p1", "several", lam=heterogeneous, mu=lambda x: 1 + x[1])
    whole = whole_share(case.matrix, uncoupled_rows(case.matrix))
    found = searched(case.matrix, (3, 2))
    assert len(found) <= 2
    assert all(one.share >= 0.98 * whole for one in found)


@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1", "tet-p1"])
def test_whether_nodes_stand_one_after_the_other_shows(kind):
    in_turn, at_random = (held(kind, "symmetry", order).matrix for order in ("interleaved", "at random"))
    assert next_to_likest(in_turn, reach(in_turn)) > 0.5
    assert next_to_likest(at_random, reach(at_random)) < 0.1
