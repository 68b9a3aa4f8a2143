"""Several nodes that couple to the same unknowns, rows at random: what holds whichever rows belong together."""

from dataclasses import replace

import numpy as np
import pytest
from assembled import box, heterogeneous, permuted_nodes, stiffness
from supported import Given, assert_certified, given, judged

from unassemble.elasticity import recover_elasticity
from unassemble.elasticity.nodal import nodal_matrix
from unassemble.elasticity.nullspace.identities import identities
from unassemble.elasticity.positions import solve
from unassemble.elasticity.rows.constants import uncoupled_rows
from unassemble.elasticity.rows.grouping import same_pattern
from unassemble.elasticity.scattered.patterns import with_patterns
from unassemble.elasticity.unknowns import given_numbering
from unassemble.errors import GeometryError

MATERIALS = {"one": {"lam": 1.5}, "varying": {"lam": heterogeneous, "mu": lambda x: 1 + x[1] + x[0] * x[1]}}


def body(kind, support, material="varying", perturb=0.0, zeros="stored", counts=(6, 7)):
    case = stiffness(kind, box(kind, counts, perturb=perturb), **MATERIALS[material])
    return given(permuted_nodes(case, seed=1), support, "at random", zeros)


@pytest.mark.parametrize("perturb", [0.0, 0.2])
@pytest.mark.parametrize("material", ["one", "varying"])
@pytest.mark.parametrize(("support", "missing"), [("free", 0.0), ("clamp", 0.11), ("symmetry", 0.31)])
def test_quadrilaterals_of_nine_nodes(material, perturb, support, missing):
    """In each cell of the rim at least two nodes share their neighbours, and so do 80 of 143 nodes here."""
    case = body("quad-q2", support, material, perturb)
    assert_certified(case, 1e-10, missing, split=0)


def test_halves_are_not_joined_where_that_sets_others_free():
    """More rows are whole then, and touch halves of which no row tells the place."""
    shape = box("quad-q2", (4, 7), perturb=0.2, seed=162)
    material = {"lam": heterogeneous, "mu": lambda x: 1 + x[1] + x[0] * x[1]}
    case = permuted_nodes(stiffness("quad-q2", shape, **material), seed=162)
    truth = given(case, "penalty rollers", "at random", "stored", seed=162)
    found = judged(recover_elasticity(truth.matrix), truth)
    assert found.error < 1e-10
    assert found.missing < 0.3


def with_two_rows_gone(case):
    """Without the first direction of one node, and the second of another that couples to the same unknowns."""
    x, y = case.points[case.node].T
    near = np.linalg.norm(case.points[case.node] - (x.min(), y.min()), axis=1)
    corner = case.node[np.argmin(near)]
    fellow = case.node[np.argmin(np.where(case.node == corner, np.inf, near))]
    gone = ((case.node == corner) & (case.direction == 0)) | ((case.node == fellow) & (case.direction == 1))
    kept = np.flatnonzero(~gone)
    return Given(case.matrix[kept][:, kept], case.node[kept], case.direction[kept], case.points)


def equations_of_patterns(case, touched):
    """What the equations of patterns leave of the true positions; all rows may count as valid, to touch all nodes."""
    matrix, n = case.matrix, len(case.node)
    nodal = nodal_matrix(matrix, given_numbering(matrix, np.arange(n), case.direction))
    group = same_pattern(matrix, np.zeros(n, dtype=bool))
    whole = np.abs(matrix @ np.eye(2)[case.direction]) < 1e-9
    for c in range(2):
        whole[:, c] &= np.bincount(group, ~whole[:, c])[group] == 0
    valid = whole[nodal.row_of] & (nodal.row_of >= 0)[:, :, None]
    counted = np.ones_like(valid) if touched else valid
    extended, places = with_patterns(nodal, counted, group, np.arange(n), case.direction, whole)
    points = np.concatenate([case.points[case.node], np.zeros((extended.n - nodal.n, 2))])
    level = places.sum(axis=(1, 2, 3)) == 2
    rows = np.arange(nodal.n, extended.n)
    local = identities(extended, places, rows[level[rows]] if touched else rows)
    return local.residual(points[local.columns][:, :, None])


def test_the_equations_of_patterns_hold():
    """Also where some nodes of a pattern lack a direction, which the other rows do not show."""
    left = equations_of_patterns(body("quad-q2", "symmetry", perturb=0.2), False)
    assert len(left) > 10
    assert np.abs(left).max() < 1e-12


def test_as_many_rows_of_two_directions_need_not_be_those_of_the_same_nodes():
    left = equations_of_patterns(with_two_rows_gone(body("quad-q2", "free", perturb=0.2)), True)
    assert len(left) > 10
    assert np.abs(left).max() < 1e-12


def exchanged(case, place, direction):
    """Nodes of rows after the two of one pattern nearest to a place have exchanged their rows of a direction."""
    node = np.unique(case.node, return_inverse=True)[1]
    group = same_pattern(case.matrix, uncoupled_rows(case.matrix))
    several = np.array([len(np.unique(node[group == one])) == 2 for one in range(group.max() + 1)])
    away = np.where(several[group], np.linalg.norm(case.points[case.node] - place, axis=1), np.inf)
    first, second = np.unique(node[group == group[np.argmin(away)]])
    rows = np.flatnonzero(np.isin(node, (first, second)) & (case.direction == direction))
    again = node.copy()
    again[rows] = np.where(node[rows] == first, second, first)
    return again, np.isin(node, (first, second))


def test_rows_next_to_several_supports_can_change_places():
    """The identities hold for these as well: they do not tell which rows are one node's, nor where these nodes are.

    Elements do.
    """
    case = body("quad-s2", "several")
    assert_certified(case, 1e-9, 0.36, split=0)
    node = np.unique(case.node, return_inverse=True)[1]
    other, moved = exchanged(case, (0.6, 0.94), 0)
    right, wrong = (given_numbering(case.matrix, one, case.direction) for one in (node, other))
    found, rival = (solve(nodal_matrix(case.matrix, one), None) for one in (right, wrong))
    assert found.unique
    assert rival.unique
    first, second = found.points[right.node_of_row], rival.points[wrong.node_of_row]
    known = np.isfinite(first + second).all(axis=1)
    assert known[moved].all()
    design = np.column_stack([second[known].ravel(), np.tile(np.eye(2), (known.sum(), 1))])
    fit = np.linalg.lstsq(design, first[known].ravel())[0]
    assert np.abs(design @ fit - first[known].ravel()).max() > 0.01  # of the mean edge length
    told = recover_elasticity(case.matrix, numbering=wrong)
    assert not np.isfinite(told.points[wrong.node_of_row[moved]]).any()


def mistaken(case, first, second, left_over):
    """A numbering that gives one row of the second node to the first, whose own row stands alone."""
    node = np.unique(case.node, return_inverse=True)[1]
    wrong = node.copy()
    own = np.flatnonzero((node == first) & (case.direction == left_over))
    other = np.flatnonzero((node == second) & (case.direction == left_over))
    wrong[own], wrong[other] = node.max() + 1, first
    return replace(given_numbering(case.matrix, wrong, case.direction), kind="pattern")


def neighbours(case):
    """Two nodes coupled to each other, far from the rim."""
    node = np.unique(case.node, return_inverse=True)[1]
    first = int(node[np.argmin(np.linalg.norm(case.points[case.node] - 0.45, axis=1))])
    row = np.flatnonzero(node == first)[0]
    near = np.setdiff1d(node[case.matrix[[row]].indices], first)
    return first, int(near[0])


def test_a_row_joined_to_the_wrong_node_is_placed_by_itself():
    case = body("tet-p1", "free", counts=(5, 5, 5))
    numbering = mistaken(case, *neighbours(case), 2)
    found = recover_elasticity(case.matrix, numbering=numbering)
    truth = judged(found, case)
    assert truth.error < 1e-10
    assert truth.missing < 0.1
    assert truth.split == 0


def test_where_no_rows_can_be_placed_by_themselves_it_is_said():
    """In the plane a row has one equation for two coordinates."""
    case = body("quad-q1", "free", counts=(4, 5))
    numbering = mistaken(case, *neighbours(case), 1)
    with pytest.raises(GeometryError, match="numbering"):
        recover_elasticity(case.matrix, numbering=numbering)
