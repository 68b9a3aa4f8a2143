"""Rows in any order: linear elements come back, and no quadratic ones come back wrong."""

from contextlib import suppress

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import box, heterogeneous, permuted_nodes, recover_elasticity, stiffness
from supported import SUPPORTS, assert_certified, given, judged

from unassemble.errors import RecoveryError

COUNTS = {"tri-p1": (8, 9), "quad-q1": (8, 9), "tet-p1": (4, 5, 5), "hex-q1": (5, 6, 5), "tri-p2": (6, 7),
          "quad-s2": (6, 7), "quad-q2": (6, 7), "tet-p2": (3, 4, 4), "hex-s2": (4, 5, 4)}  # fmt: skip
VARYING = {"lam": heterogeneous, "mu": lambda x: 1 + x[1] + x[0] * x[1]}


def body(kind, support, zeros, perturb, material, seed=0):
    shape = box(kind, COUNTS[kind], perturb=perturb)
    return given(permuted_nodes(stiffness(kind, shape, **material), seed=1), support, "at random", zeros, seed)


@pytest.mark.parametrize("support", SUPPORTS)
@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1", "tet-p1", "hex-q1"])
@pytest.mark.parametrize(("perturb", "material"), [(0.0, {"lam": 1.5}), (0.2, VARYING)])
def test_linear_elements_come_back(kind, support, perturb, material):
    missing = 0.26 if support == "several" else 0.0
    assert_certified(body(kind, support, "stored", perturb, material, seed=3), 1e-9, missing, split=0)


@pytest.mark.parametrize("support", ["free", "clamp", "roller", "symmetry", "penalty rollers"])
@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1", "tet-p1", "hex-q1"])
def test_zeros_need_not_be_stored(kind, support):
    assert_certified(body(kind, support, "dropped", 0.2, VARYING), 1e-9, 0.0, split=0)


@pytest.mark.slow
@pytest.mark.parametrize("support", ["free", "clamp", "penalty clamp"])
@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1", "tet-p1", "hex-q1"])
def test_nor_where_most_of_them_vanish(kind, support):
    """In structured boxes of one material sums vanish by symmetry whatever the directions."""
    assert_certified(body(kind, support, "dropped", 0.0, {"lam": 1.5}), 1e-9, 0.0, split=0)


@pytest.mark.parametrize("support", ["free", "clamp", "symmetry"])
@pytest.mark.parametrize("kind", ["tri-p2", "tet-p2"])
def test_of_quadratic_simplices_some_nodes_are_missing(kind, support):
    """Nodes that belong to one cell only couple to the same unknowns: nothing tells which rows are theirs."""
    assert_certified(body(kind, support, "stored", 0.2, VARYING), 1e-9, 0.56, split=0)


@pytest.mark.slow
@pytest.mark.parametrize("support", ["free", "symmetry", "several"])
@pytest.mark.parametrize("kind", ["quad-s2", "quad-q2", "hex-s2"])
@pytest.mark.parametrize("zeros", ["stored", "dropped"])
def test_other_quadratic_elements_are_refused_or_right(kind, support, zeros):
    case = body(kind, support, zeros, 0.2, VARYING)
    found = None
    with suppress(RecoveryError):
        found = recover_elasticity(case.matrix)
    assert found is None or not found.certified or judged(found, case).error < 1e-8


def test_the_pieces_of_a_body_are_read_one_by_one():
    one = permuted_nodes(stiffness("tet-p1", box("tet-p1", (4, 4, 4), perturb=0.2), lam=1.5), seed=1)
    two = given(one, "roller", "interleaved", "stored")
    n = two.matrix.shape[0]
    pair = np.zeros((2, 2))
    rows = np.random.default_rng(5).permutation(2 * n)
    pair[0, 0] = pair[1, 1] = 1
    matrix = np.kron(pair, two.matrix.toarray())[rows][:, rows]
    found = recover_elasticity(type(two.matrix)(matrix))
    assert found.certified
    assert len(found.evidence) == 2
    assert not found.node_status.any()


def test_a_single_element_is_ambiguous():
    """The rows along y of a square, paired with those of opposite corners, are those of its mirror image."""
    case = stiffness("quad-q1", box("quad-q1", (2, 2)))
    matrix = sp.csr_array(case.matrix)
    across = [int(np.argmin(np.linalg.norm(case.points - 1 + point, axis=1))) for point in case.points]
    for rows in (2 * np.arange(4) + 1, 2 * np.array(across) + 1):
        order = np.concatenate([2 * np.arange(4), rows])
        found = recover_elasticity(matrix[order][:, order])
        assert (found.status, found.uniqueness) == ("ambiguous", "ambiguous")
        assert "rows are of one node may be another choice" in found.reason
