"""Unknowns in one of the usual orders of which supports took some: which rows belong together, and what stays open."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import box, heterogeneous, permuted_nodes, stiffness
from supported import assert_certified, given, judged

from unassemble.elasticity import recover_elasticity
from unassemble.elasticity.directions.directions import find_directions
from unassemble.elasticity.doubts import with_doubts
from unassemble.elasticity.nodal import nodal_matrix
from unassemble.elasticity.ordered.alignment import aligned
from unassemble.elasticity.ordered.held import Places, joined_by_place
from unassemble.elasticity.ordered.matching import matched_by_pattern
from unassemble.elasticity.rows.constants import proven_directions, uncoupled_rows
from unassemble.elasticity.rows.grouping import by_first_row, same_pattern
from unassemble.elasticity.rows.numbering import measured
from unassemble.elasticity.unknowns import find_numbering, given_numbering


def groups(*directions: str) -> tuple[np.ndarray, np.ndarray]:
    names = sorted(set("".join(directions)))
    group = np.array([names.index(one) for some in directions for one in some])
    return group, np.repeat(np.arange(len(directions)), [len(some) for some in directions])


def quadratic(kind: str, support: str, order: str, seed: int, perturb: float = 0.2):
    mesh = box(kind, {"tet-p2": (3, 4, 4), "tri-p2": (6, 7)}.get(kind, (4, 5, 4)), perturb=perturb)
    body = permuted_nodes(stiffness(kind, mesh, lam=heterogeneous, mu=lambda x: 1 + x[1] + x[0] * x[1]), seed=seed)
    return given(body, support, order, "stored")


def test_order_tells_which_node_of_a_group_lacks_a_direction():
    group, direction = groups("abcbd", "acbd")
    node, open_row = matched_by_pattern(group, direction, 2)
    assert node.tolist() == [0, 1, 2, 3, 4, 0, 2, 3, 4]
    assert not open_row.any()


def test_neighbours_of_one_group_of_which_one_lacks_a_direction_stay_open():
    group, direction = groups("abbc", "abc")
    node, open_row = matched_by_pattern(group, direction, 2)
    assert node.tolist() == [0, 1, 2, 3, 0, 4, 3]
    assert np.flatnonzero(open_row).tolist() == [1, 2, 5]


def test_as_many_rows_of_different_nodes_are_not_taken_for_one():
    group, direction = groups("abcdef", "acdefb")  # one node of group b lacks the second direction, another the first
    node, open_row = matched_by_pattern(group, direction, 2)
    assert np.flatnonzero(open_row).tolist() == [1, 11]
    assert node[1] != node[11]


@pytest.mark.parametrize("kind", ["tet-p2", "hex-s2"])
def test_by_component_on_a_roller_every_node_is_found(kind):
    case = quadratic(kind, "roller", "by component", 4)
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-8
    assert truth.missing == truth.split == 0


@pytest.mark.parametrize(
    ("kind", "support"), [("hex-s2", "symmetry"), ("hex-q2", "symmetry"), ("tri-p2", "several"), ("hex-q2", "several")]
)
def test_by_component_no_more_is_lost_than_with_the_numbering_given(kind, support):
    case = quadratic(kind, support, "by component", 4, perturb=0.0)
    known = recover_elasticity(case.matrix, numbering=given_numbering(case.matrix, case.node, case.direction))
    assert_certified(case, 1e-8, judged(known, case).missing, 0)


def test_rows_go_together_one_by_one_between_nodes_that_are_known_if_those_of_the_identity_count():
    group, direction = groups("acbbd", "abd")  # between nodes a and d the second direction is c, b and one more
    places = Places(np.array([0, 1, 2, 3, 4, 5, 7, 9]), 10)
    node = np.array([0, 1, 2, 3, 4, 0, 6, 4])
    open_row = group == group[2]
    joined, still_open = joined_by_place(places, group, node, direction, 2, open_row)
    assert joined[6] == joined[2]
    assert joined[3] != joined[2]
    assert not still_open.any()


def test_rows_of_different_patterns_do_not_go_together():
    group, direction = groups("acbbd", "abd")
    places = Places(np.array([0, 1, 2, 3, 4, 5, 6, 9]), 10)  # the row of group b now stands where one of group c would
    node = np.array([0, 1, 2, 3, 4, 0, 6, 4])
    open_row = group == group[2]
    joined, still_open = joined_by_place(places, group, node, direction, 2, open_row)
    assert len(np.unique(joined)) == len(np.unique(node))
    assert np.array_equal(still_open, open_row)


@cache
def where_symmetry_planes_meet(order):
    case = quadratic("hex-s2", "symmetry", order, 1)
    return case, find_numbering(case.matrix)


@pytest.mark.parametrize("order", ["interleaved", "by component"])
def test_where_symmetry_planes_meet_nothing_wrong_is_certified(order):
    case, numbering = where_symmetry_planes_meet(order)
    found = recover_elasticity(case.matrix, numbering=numbering)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-8
    assert truth.missing < 0.2


def test_equilibrium_names_rows_where_symmetry_planes_meet():
    """One direction leaves no gap along an edge, but the least energy has another one there."""
    case, found = where_symmetry_planes_meet("interleaved")
    assert np.array_equal(found.direction_of_row, case.direction)
    assert np.array_equal(found.node_of_row, by_first_row(case.node))
    assert found.unnamed is not None
    assert found.unnamed.any()
    whole = recover_elasticity(case.matrix, numbering=given_numbering(case.matrix, case.node, case.direction))
    assert judged(recover_elasticity(case.matrix, numbering=found), case).missing == judged(whole, case).missing < 0.02


def test_no_direction_that_sums_prove_is_wrong():
    case, _ = where_symmetry_planes_meet("interleaved")
    group = same_pattern(case.matrix, uncoupled_rows(case.matrix))
    nodes = by_first_row(np.where(np.bincount(group)[group] <= 3, group, len(group) + np.arange(len(group))))
    least = find_directions(case.matrix, nodes, uncoupled_rows(case.matrix), 3, ordered=True)
    wrong = least != case.direction
    assert wrong.any()
    assert not (wrong & proven_directions(case.matrix, least, group, 3)).any()
    proven = proven_directions(case.matrix, case.direction, group, 3)
    assert proven.mean() > 0.95
    exchanged = case.direction.copy()
    row = np.flatnonzero(proven)[0]
    exchanged[row] = (exchanged[row] + 1) % 3
    assert not proven_directions(case.matrix, exchanged, group, 3)[row]


@pytest.mark.parametrize(("kind", "seed"), [("tet-p1", 29), ("hex-s2", 7)])
def test_small_bodies_in_which_order_misleads(kind, seed):
    """Rows of two nodes taken for one, and a node whose rows came apart by directions that were found anew later."""
    body = stiffness(kind, box(kind, (3, 3, 3)), lam=heterogeneous, mu=lambda x: 1 + x[1] + x[0] * x[1], within=True)
    case = given(permuted_nodes(body, seed=seed), "symmetry", "interleaved", "stored")
    found = recover_elasticity(case.matrix)
    assert found.certified
    assert judged(found, case).error < 1e-9


def test_nodes_that_agree_on_a_wrong_direction_are_told_by_whole_ones():
    """Three nodes on an edge where planes meet fit each other, and with zeros dropped no pattern contradicts."""
    body = stiffness("hex-s2", box("hex-s2", (3, 4, 3)), lam=heterogeneous, mu=lambda x: 1 + x[1] + x[0] * x[1])
    case = given(permuted_nodes(body, seed=1), "symmetry", "interleaved", "dropped")
    found = find_numbering(case.matrix)
    assert np.array_equal(found.direction_of_row, case.direction)
    assert found.unnamed is not None


@pytest.mark.parametrize("perturb", [0.0, 0.2])
def test_nodes_known_only_to_lie_in_one_plane_are_no_piece(perturb):
    case = given(permuted_nodes(stiffness("quad-s2", box("quad-s2", (6, 7), perturb=perturb)), seed=1),
                 "symmetry", "by component", "stored")  # fmt: skip
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert len(found.evidence) == 1
    assert truth.error < 1e-10
    assert truth.missing < 0.1


def test_nodes_that_may_be_halves_say_nothing_of_planes():
    """Their missing row may stand elsewhere; taken for nodes of a plane they spoiled all that hangs on them."""
    shape = box("quad-s2", (6, 7))
    body = permuted_nodes(stiffness("quad-s2", shape, lam=heterogeneous, mu=lambda x: 1 + x[1] + x[0] * x[1]), seed=1)
    case = given(body, "several", "by component", "stored")
    found = recover_elasticity(case.matrix)
    assert found.certified
    assert judged(found, case).error < 1e-9


def test_the_heaviest_alignment_wins_over_the_likest_pairs():
    """Row 1 is likest row 2 of the other list, but then row 2 and row 3 would have no partners."""
    r, s = np.array([0, 1, 1, 2, 3]), np.array([0, 1, 2, 2, 3])
    likeness = np.array([1.0, 0.9, 0.95, 0.9, 1.0])
    assert aligned(r, s, likeness).tolist() == [0, 1, 3, 4]


def test_pairs_that_another_alignment_would_replace_are_left_out():
    """One of two rows as alike has no partner, and order does not tell which."""
    r, s = np.array([0, 1, 2, 3]), np.array([0, 1, 1, 2])
    assert aligned(r, s, np.array([1.0, 0.9, 0.9, 1.0])).tolist() == [0, 3]


def boundary_first(kind: str, counts: tuple[int, int], order: str, zeros: str, perturb: float = 0.2):
    """A body on two symmetry planes whose nodes there come first, as mesh generators number them; inner ones anyhow.

    As many lie on one plane as on the other, so that single unknowns come in pairs.
    """
    body = stiffness(kind, box(kind, counts, perturb=perturb), lam=heterogeneous if perturb else 1.0)
    x, y = body.points.T
    rank = np.where(y == 0, 1.0, np.where(x == 0, 2.0, 3.0))
    rank[(x == 0) & (y == 0)] = 0.0
    chance = np.random.default_rng(5).permutation(len(x))
    nodes = np.lexsort((chance, rank))
    rows = (nodes[:, None] * 2 + np.arange(2)).ravel()
    moved = replace(body, matrix=sp.csr_array(body.matrix[rows][:, rows]), points=body.points[nodes])
    return given(moved, "symmetry", order, zeros)


@pytest.mark.parametrize("order", ["interleaved", "by component"])
@pytest.mark.parametrize(("kind", "counts"), [("quad-q1", (9, 9)), ("tri-p1", (9, 9)), ("tri-p2", (6, 6))])
def test_single_unknowns_in_pairs_are_not_taken_for_nodes(kind, counts, order):
    case = boundary_first(kind, counts, order, "stored")
    numbering = find_numbering(case.matrix)
    named = np.ones(len(case.node), dtype=bool) if numbering.unnamed is None else ~numbering.unnamed
    np.testing.assert_array_equal(numbering.direction_of_row[named], case.direction[named])
    assert np.count_nonzero(named) > 0.9 * len(named)
    assert_certified(case, 1e-8, 0.1)


@pytest.mark.parametrize("order", ["interleaved", "by component"])
@pytest.mark.parametrize("kind", ["quad-q1", "tri-p1", "quad-s2"])
def test_nor_are_they_where_zeros_are_not_stored(kind, order):
    case = boundary_first(kind, (9, 9) if kind != "quad-s2" else (6, 6), order, "dropped", perturb=0.0)
    assert_certified(case, 1e-8, 0.4)


def test_halves_of_a_node_need_not_be_coupled():
    """On a straight side the entry between two directions of a node vanishes: nothing but neighbours ties its rows."""
    body = stiffness("quad-q1", box("quad-q1", (6, 6)))
    case = given(body, "clamp", "interleaved", "dropped")
    node = np.unique(case.node, return_inverse=True)[1]
    rows = np.flatnonzero(case.node == np.linalg.norm(body.points - (0.6, 0.0), axis=1).argmin())
    assert case.matrix[rows[0], rows[1]] == 0
    node[rows[1]] = node.max() + 1
    numbering = measured(case.matrix, node, case.direction, 2, "interleaved")
    nodal = with_doubts(nodal_matrix(case.matrix, numbering), numbering)
    assert set(node[rows]) <= set(np.flatnonzero(nodal.doubtful))


@pytest.mark.parametrize("material", [{"lam": 1.5}, {"lam": heterogeneous, "mu": lambda x: 1 + x[1] + x[0] * x[1]}])
def test_an_order_without_gaps_is_not_given_up_for_patterns_that_leave_rows_open(material):
    """Rows of the identity stand among the others, and entries that vanished are not stored."""
    body = permuted_nodes(stiffness("hex-s2", box("hex-s2", (3, 4, 4), perturb=0.2), **material), seed=1)
    case = given(body, "identity rollers", "by component", "dropped")
    assert_certified(case, 1e-11, 0.03, split=0)  # without those next to the corner
