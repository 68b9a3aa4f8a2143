"""Rows at random next to supports, several nodes of one pattern: rows likest each other with directions exchanged."""

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import box, heterogeneous, permuted_nodes, stiffness
from supported import assert_certified, given, judged

from unassemble.clock import Clock
from unassemble.elasticity.nodal import nodal_matrix
from unassemble.elasticity.recover import place_nodes
from unassemble.elasticity.rows.constants import row_sizes, uncoupled_rows, with_penalty, without_penalties
from unassemble.elasticity.rows.grouping import same_pattern
from unassemble.elasticity.scattered.exchange import exchanged, fullest
from unassemble.elasticity.scattered.plane_rows import of_planes
from unassemble.elasticity.scattered.row_positions import single_nodes
from unassemble.elasticity.scattered.scattered import scattered
from unassemble.elasticity.unknowns import find_numbering

MATERIALS = {"one": {"lam": 1.5}, "varying": {"lam": heterogeneous, "mu": lambda x: 1 + x[1] + x[0] * x[1]}}


def body(kind, support, material="varying", perturb=0.2, counts=(4, 5, 4), *, within=False):
    case = stiffness(kind, box(kind, counts, perturb=perturb), **MATERIALS[material], within=within)
    return given(permuted_nodes(case, seed=1), support, "at random", "stored")


def pattern(case):
    identity = uncoupled_rows(case.matrix)
    return same_pattern(case.matrix, identity), ~identity


def made_up(node, case, live):
    """Nodes whose rows are those of several true ones."""
    pairs = np.unique(np.column_stack([node, case.node])[live], axis=0)
    return int((np.bincount(pairs[:, 0]) > 1).sum())


@pytest.mark.parametrize("material", ["one", "varying"])
@pytest.mark.parametrize("support", ["symmetry", "several"])
@pytest.mark.parametrize("kind", ["hex-s2", "hex-q2", "quad-s2", "quad-q2"])
def test_rows_likest_each_other_are_one_node_s(kind, support, material):
    case = body(kind, support, material, counts=(5, 4) if kind.startswith("quad") else (4, 4, 3))
    d = case.points.shape[1]
    group, live = pattern(case)
    start = single_nodes(group, case.direction, d)
    node = exchanged(case.matrix, live, group, start, case.direction, d)
    count = [len(np.unique(one[live])) for one in (start, node, case.node)]
    assert made_up(node, case, live) == 0
    assert count[1] - count[2] < 0.15 * (count[0] - count[2])


def test_in_corners_no_direction_is_one_of_which_each_node_has_a_row():
    """Of the three nodes next to a corner of 20-node hexahedra each has one row, of another direction."""
    case = body("hex-s2", "symmetry")
    group, live = pattern(case)
    base = fullest(case.matrix, live, group, case.direction, 3)
    for one in range(group.max() + 1):
        rows = np.flatnonzero((group == one) & live)
        if base[one] >= 0:
            assert np.isin(case.node[rows], case.node[rows[case.direction[rows] == base[one]]]).all()
    corner = np.argmin(np.linalg.norm(case.points[case.node] - case.points.min(axis=0), axis=1))
    assert base[group[corner]] == -1
    assert len(np.unique(case.node[group == group[corner]])) == 3


@pytest.mark.parametrize("kind", ["hex-s2", "hex-q2"])
def test_directions_next_to_several_supports_are_set_right(kind):
    """Few rows are far from all of them, so that translations in equilibrium leave a tenth of the rows wrong."""
    case = body(kind, "several", perturb=0.0, within=True)
    numbering = scattered(case.matrix, (3,))
    live = ~numbering.identity_row
    told = live & ~numbering.unnamed
    pairs = np.unique(np.column_stack([numbering.direction_of_row, case.direction])[told], axis=0)
    assert len(pairs) == 3
    named = dict(pairs.tolist())
    wrong = np.array([named[a] for a in numbering.direction_of_row.tolist()]) != case.direction
    assert np.count_nonzero(wrong & live) < 0.02 * np.count_nonzero(live)


def test_penalties_are_replaced_by_what_makes_rows_whole():
    case = body("hex-q1", "penalty rollers")
    changed = without_penalties(case.matrix)
    penalised = with_penalty(case.matrix, row_sizes(case.matrix))
    assert penalised.any()
    assert not with_penalty(changed, row_sizes(changed)).any()
    assert np.abs(changed.sum(axis=1)[penalised]).max() < 1e-12
    assert abs(changed - case.matrix)[~penalised].max() == 0


@pytest.mark.parametrize(
    ("kind", "support", "material", "perturb", "missing"),
    [
        ("hex-q2", "symmetry", "one", 0.0, 0.08),
        ("hex-q2", "several", "varying", 0.2, 0.17),
        ("hex-s2", "symmetry", "one", 0.2, 0.08),
        ("hex-s2", "several", "varying", 0.2, 0.2),
    ],
)
def test_quadratic_hexahedra_come_back_as_with_the_numbering(kind, support, material, perturb, missing):
    """No more nodes are missing than with the numbering given, where it is those next to clamps and corners."""
    assert_certified(body(kind, support, material, perturb), 1e-10, missing, split=0)


def test_likely_nodes_are_certified_by_elements_only():
    """No elements re-assemble a material that varies within these; all identities hold, as they do with wrong nodes."""
    case = body("hex-s2", "several", within=True)
    numbering = find_numbering(case.matrix)
    assert numbering.likely
    found = place_nodes(nodal_matrix(case.matrix, numbering), numbering, Clock(), whole=case.matrix)
    assert judged(found, case).error < 1e-10
    assert not found.certified
    assert "only elements" in found.reason


def test_nodes_with_all_their_rows_are_no_members_of_what_planes_decide():
    """Of five nodes of a pattern two have all rows, two lie in the plane x = 0: the loose row is the fifth one's."""
    points = np.array([[0.0, 0.0], [0.0, 1.0], [0.3, 0.0], [np.nan, np.nan], [0.3, 1.0], [0.3, 2.0]])
    node = np.array([0, 1, 2, 3, 4, 4, 5, 5])
    direction = np.array([1, 1, 1, 0, 0, 1, 0, 1])
    nobody = np.zeros((6, 2), dtype=bool)
    label, settled = of_planes(points, nobody, np.zeros(8, np.int64), node, direction, node < 4, ordered=False)
    assert label.tolist() == [0, 1, 2, 2, 4, 4, 5, 5]
    assert np.array_equal(settled, node < 4)


def test_without_patterns_of_several_nodes_nothing_is_joined():
    case = body("hex-q1", "symmetry")
    group, live = pattern(case)
    start = single_nodes(group, case.direction, 3)
    assert np.array_equal(exchanged(case.matrix, live, group, start, case.direction, 3), start)
    assert not find_numbering(sp.csr_array(case.matrix)).likely
