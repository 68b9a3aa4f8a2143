"""Rows at random without the entries that vanish: these are put back, and rows show their nodes by pattern again."""

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import box, heterogeneous, permuted_nodes, stiffness
from supported import assert_certified, given

from unassemble.elasticity.directions.extension import SETTLED, extended_directions
from unassemble.elasticity.rows.grouping import same_pattern
from unassemble.elasticity.scattered.filling import filled, filled_by_direction, likest

MATERIALS = {"one": {"lam": 1.5}, "varying": {"lam": heterogeneous, "mu": lambda x: 1 + x[1] + x[0] * x[1]}}
COUNTS = {"quad-s2": (6, 7), "quad-q2": (6, 7), "tet-p2": (3, 3, 4), "hex-s2": (4, 4, 4)}


def body(kind, support, material, perturb=0.0, zeros="dropped"):
    case = stiffness(kind, box(kind, COUNTS[kind], perturb=perturb), **MATERIALS[material])
    return given(permuted_nodes(case, seed=1), support, "at random", zeros)


def pattern_of_nodes(case):
    """(N, N) where the nodes of two rows have some entry in common, the most that may be put back."""
    node = np.unique(case.node, return_inverse=True)[1]
    onto = sp.csr_array((np.ones(len(node)), (np.arange(len(node)), node)))
    coupled = onto.T @ sp.csr_array((np.ones(case.matrix.nnz), case.matrix.indices, case.matrix.indptr)) @ onto
    return (onto @ coupled @ onto.T).toarray() > 0


def stored(matrix):
    return sp.csr_array((np.ones(matrix.nnz), matrix.indices, matrix.indptr), shape=matrix.shape).toarray() > 0


def labels_of_nodes(case, label):
    """How many labels the rows of each node have."""
    return np.bincount(np.unique(np.column_stack([case.node, label]), axis=0)[:, 0])


@pytest.mark.parametrize(
    ("kind", "material", "support"),
    [("quad-q2", "varying", "free"), ("quad-q2", "varying", "clamp"), ("quad-q2", "one", "clamp"),
     ("quad-s2", "one", "free")],
)  # fmt: skip
def test_entries_are_put_back_between_coupled_nodes_only(kind, material, support):
    case = body(kind, support, material)
    live = np.ones(len(case.node), dtype=bool)
    whole = filled(case.matrix, likest(case.matrix))
    more = filled_by_direction(whole, case.direction, live, 2)
    most = pattern_of_nodes(case)
    assert not (stored(more) & ~most).any()
    assert abs(more - case.matrix).max() == 0
    assert labels_of_nodes(case, same_pattern(case.matrix, ~live)).max() > 1
    assert labels_of_nodes(case, same_pattern(more, ~live)).max() == 1


@pytest.mark.parametrize(("kind", "material"), [("quad-s2", "varying"), ("quad-q2", "one"), ("hex-s2", "varying")])
def test_directions_spread_from_rows_that_may_be_no_node(kind, material):
    """Sums also vanish where two directions are taken for one, as from two rows of one direction."""
    case = body(kind, "free", material)
    d = case.direction.max() + 1
    start = likest(case.matrix)
    live = np.ones(len(start), dtype=bool)
    direction, share = extended_directions(filled(case.matrix, start), start, live, d, sure=False)
    assert share > SETTLED
    assert len(np.unique(np.column_stack([direction, case.direction]), axis=0)) == d


@pytest.mark.parametrize(
    ("kind", "support", "material", "missing"),
    [
        ("quad-q2", "free", "varying", 0.0),
        ("quad-q2", "symmetry", "varying", 0.31),
        ("quad-s2", "free", "one", 0.0),
        ("quad-s2", "identity clamp", "one", 0.08),
        ("quad-s2", "penalty rollers", "one", 0.0),
        ("tet-p2", "free", "varying", 0.0),
    ],
)
def test_structured_quadratic_elements_come_back(kind, support, material, missing):
    case = body(kind, support, material)
    assert_certified(case, 1e-10, missing, split=0)


@pytest.mark.parametrize(
    ("kind", "counts", "perturb", "support", "material"),
    [("tri-p1", (12, 13), 0.0, "roller", "one"), ("tet-p1", (6, 6, 6), 0.2, "symmetry", "varying")],
)
def test_direction_by_direction_no_node_is_lost(kind, counts, perturb, support, material):
    """Alignment of whole directions leaves some rows apart there."""
    case = stiffness(kind, box(kind, counts, perturb=perturb), **MATERIALS[material])
    case = given(permuted_nodes(case, seed=3), support, "by component", "dropped")
    assert_certified(case, 1e-9, 0.0)
