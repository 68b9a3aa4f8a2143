"""Rows in random order: directions set right by the sums that have to vanish, and doubts where patterns are alike."""

from itertools import permutations

import numpy as np
import pytest
from assembled import box, heterogeneous, permuted_nodes, stiffness
from supported import assert_certified, given

from unassemble.elasticity.directions.sums import names_of, set_right

COUNTS = {"tri-p1": (8, 9), "tri-p2": (6, 7), "tet-p1": (4, 5, 5)}


def varying_shear(x):
    return 1 + x[1] + x[0] * x[1]


def body(kind, perturb=0.0):
    case = stiffness(kind, box(kind, COUNTS[kind], perturb=perturb), lam=heterogeneous, mu=varying_shear)
    return permuted_nodes(case, seed=1)


def wrong(case, group, live, direction):
    """Number of rows whose direction differs after set_right, whatever the names of the axes."""
    size = np.bincount(group)
    d = case.direction.max() + 1
    order = np.argsort(group, kind="stable")
    start = np.concatenate([[0], np.cumsum(size)[:-1]])
    members = [order[start[size == k][:, None] + np.arange(k)] for k in range(1, d + 1)]
    after = set_right(case.matrix, group, members, live, direction, names_of(d))
    return min(np.count_nonzero(np.array(names)[after] != case.direction) for names in permutations(range(d)))


@pytest.mark.parametrize("support", ["free", "penalty rollers"])
@pytest.mark.parametrize("kind", ["tri-p1", "tet-p1"])
def test_directions_exchanged_in_a_corner_are_set_right(kind, support):
    """Two layers of nodes: none of them gains by changing alone, and the inner ones add up to zero."""
    case = given(body(kind), support, "interleaved", "stored")
    corner = case.points[case.node, 0] < (0.3 if kind == "tri-p1" else 0.4)
    exchanged = np.where(corner & (case.direction < 2), 1 - case.direction, case.direction)
    assert wrong(case, case.node, np.ones(len(case.node), dtype=bool), exchanged) == 0


def test_directions_of_rows_that_stand_alone_are_set_right():
    case = given(body("tri-p1"), "free", "interleaved", "stored")
    rng = np.random.default_rng(0)
    some = rng.choice(len(case.points), 6, replace=False)
    exchanged = np.where(np.isin(case.node, some), 1 - case.direction, case.direction)
    live = np.ones(len(case.node), dtype=bool)
    assert wrong(case, np.arange(len(case.node)), live, exchanged) == 0


@pytest.mark.parametrize("support", ["roller", "penalty clamp", "penalty rollers"])
@pytest.mark.parametrize(("kind", "perturb"), [("tri-p1", 0.0), ("tri-p1", 0.2), ("tet-p1", 0.2)])
def test_supports_hide_no_direction(kind, support, perturb):
    case = given(body(kind, perturb), support, "at random", "stored", seed=3)
    assert_certified(case, 1e-9, 0.0)


@pytest.mark.parametrize(("support", "missing"), [("roller", 0.0), ("symmetry", 0.05)])
def test_rows_with_the_same_neighbours_are_joined_in_the_only_way_that_fits(support, missing):
    """Rows at the corners of quadratic triangles: whether a node lacks a row, or it is another's, trial tells."""
    case = given(body("tri-p2"), support, "at random", "stored")
    assert_certified(case, 1e-9, missing, 0)
