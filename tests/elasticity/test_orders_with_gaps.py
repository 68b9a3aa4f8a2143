"""Unknowns in one of the usual orders of which supports took some: which rows belong together, and what stays open."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import box, heterogeneous, permuted_nodes, recover_elasticity, stiffness
from supported import assert_certified, given, judged

from unassemble.nodes import by_first_row, find_numbering, given_numbering


def quadratic(kind: str, support: str, order: str, seed: int, perturb: float = 0.2):
    mesh = box(kind, {"tet-p2": (3, 4, 4), "tri-p2": (6, 7)}.get(kind, (4, 5, 4)), perturb=perturb)
    body = permuted_nodes(stiffness(kind, mesh, lam=heterogeneous, mu=lambda x: 1 + x[1] + x[0] * x[1]), seed=seed)
    return given(body, support, order, "stored")


@pytest.mark.parametrize("kind", ["tet-p2", "hex-s2"])
def test_by_component_on_a_roller_every_node_is_found(kind):
    case = quadratic(kind, "roller", "by component", 4)
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-8
    assert truth.missing == truth.split == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "support"), [("hex-s2", "symmetry"), ("hex-q2", "symmetry"), ("tri-p2", "several"), ("hex-q2", "several")]
)
def test_by_component_hardly_more_is_lost_than_with_the_numbering_given(kind, support):
    case = quadratic(kind, support, "by component", 4, perturb=0.0)
    known = recover_elasticity(case.matrix, numbering=given_numbering(case.matrix, case.node, case.direction))
    assert_certified(case, 1e-8, judged(known, case).missing + 0.03, 0)


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


@pytest.mark.parametrize(("kind", "seed"), [("tet-p1", 29), ("hex-s2", 7)])
def test_small_bodies_in_which_order_misleads(kind, seed):
    """Rows of two nodes taken for one, and a node whose rows came apart by directions that were found anew later."""
    body = stiffness(kind, box(kind, (3, 3, 3)), lam=heterogeneous, mu=lambda x: 1 + x[1] + x[0] * x[1])
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


@pytest.mark.parametrize("material", [{"lam": 1.5}, {"lam": heterogeneous, "mu": lambda x: 1 + x[1] + x[0] * x[1]}])
def test_an_order_without_gaps_is_not_given_up_for_patterns_that_leave_rows_open(material):
    """Rows of the identity stand among the others, and entries that vanished are not stored."""
    body = permuted_nodes(stiffness("hex-s2", box("hex-s2", (3, 4, 4), perturb=0.2), **material), seed=1)
    case = given(body, "identity rollers", "by component", "dropped")
    assert_certified(case, 1e-11, 0.03, split=0)  # without those next to the corner
