"""Matrices in single precision, or written with few digits."""

import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import box, eliminated, error, heterogeneous, on_plane, permuted_nodes, stiffness
from supported import given, judged

from unassemble import recover
from unassemble.nodes import with_exact_sums

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "structures"))
from built import error as size_and_error, frame, plane_frame, truss

ROUNDED = {
    "single precision": lambda values: values.astype(np.float32).astype(float),
    "6 digits": lambda values: np.array([float(f"{x:.5e}") for x in values]),
    "8 digits": lambda values: np.array([float(f"{x:.7e}") for x in values]),
    "12 digits": lambda values: np.array([float(f"{x:.11e}") for x in values]),
}
LEVEL = {"single precision": 2.0**-24, "6 digits": 5e-6, "8 digits": 5e-8, "12 digits": 5e-12}


def rounded(matrix, how):
    matrix = sp.csr_array(matrix)
    return sp.csr_array((ROUNDED[how](matrix.data), matrix.indices, matrix.indptr), shape=matrix.shape)


@pytest.mark.parametrize("how", ROUNDED)
@pytest.mark.parametrize(("kind", "counts"), [("tri-p1", (12, 12)), ("hex-q1", (4, 4, 5)), ("tet-p1", (5, 5, 5))])
def test_positions_are_as_good_as_the_entries(kind, counts, how):
    case = permuted_nodes(stiffness(kind, box(kind, counts, perturb=0.2)))
    matrix, nodes = eliminated(case, np.repeat(on_plane(case, 0)[:, None], case.dim, axis=1))
    found = recover(rounded(matrix, how), operator="elasticity")
    assert found.certified
    assert f"rounded to {how}" in found.reason
    assert not found.node_status.any()
    assert error(found.points, case.points[nodes]) < min(LEVEL[how], found.position_error)


@pytest.mark.parametrize("decimals", [4, 7])
@pytest.mark.parametrize("clamped", [False, True])
@pytest.mark.parametrize(("kind", "counts"), [("tri-p1", (12, 12)), ("hex-q1", (4, 4, 5)), ("tet-p1", (5, 5, 5))])
def test_decimals(kind, counts, clamped, decimals):
    """Errors of all entries are alike, and of small ones a large part."""
    case = permuted_nodes(stiffness(kind, box(kind, counts, perturb=0.2)))
    held = np.repeat(on_plane(case, 0)[:, None], case.dim, axis=1) & clamped
    matrix, nodes = eliminated(case, held)
    coarse = sp.csr_array((np.round(3 * matrix.data, decimals), matrix.indices, matrix.indptr), shape=matrix.shape)
    found = recover(coarse, operator="elasticity")
    assert found.certified
    assert f"rounded to {decimals} decimals" in found.reason
    assert not found.node_status.any()
    assert error(found.points, case.points[nodes]) < found.position_error
    assert error(found.points, case.points[nodes]) < 0.5 * 10.0**-decimals / np.abs(coarse.data).mean()


@pytest.mark.parametrize("order", ["interleaved", "by component"])
@pytest.mark.parametrize("zeros", ["stored", "dropped"])
@pytest.mark.parametrize(("kind", "counts"), [("tri-p1", (9, 10)), ("quad-q1", (9, 10))])
def test_gaps_in_the_order_where_rollers_are(kind, counts, zeros, order):
    """Which rows are whole is told from sums that vanish up to rounding only, and from directions alone."""
    case = given(permuted_nodes(stiffness(kind, box(kind, counts, perturb=0.2), lam=1.5)), "symmetry", order, zeros)
    found = recover(rounded(case.matrix, "6 digits"))
    truth = judged(found, case)
    assert found.certified
    assert "rounded to 6 digits" in found.reason
    assert truth.error < min(4e-5, found.position_error)
    assert truth.missing < 0.25
    assert truth.split == 0


def test_nodes_that_only_elements_could_show_are_not_certified():
    """That they re-assemble up to rounding does not say which rows are one node's."""
    shape = box("tri-p2", (6, 7), perturb=0.2)
    body = permuted_nodes(stiffness("tri-p2", shape, lam=1.5, mu=lambda x: 1 + x[1] + x[0] * x[1]), seed=4)
    case = given(body, "roller", "interleaved", "dropped")
    found = recover(rounded(case.matrix, "8 digits"), operator="elasticity")
    assert not found.certified
    assert found.reason.startswith("which rows belong to one node was inferred")
    assert judged(found, case).error < 1e-4


def test_identities_that_nothing_checks_certify_no_rounded_body():
    """A spring between two nodes, and half of the nodes gone: what identities are left hold, and points are wrong."""
    rng = np.random.default_rng(45)
    shape = box("tri-p1", (4, 3), perturb=0.3, seed=45)
    case = stiffness("tri-p1", shape, lam=heterogeneous, mu=lambda x: 1 + x[1])
    coupled = sp.triu(case.matrix, 2).tocoo()
    edge = rng.integers(coupled.nnz)
    rows = (2 * (np.array([coupled.row[edge], coupled.col[edge]])[:, None] // 2) + [0, 1]).ravel()
    root = rng.standard_normal((2, 2))
    matrix = sp.lil_array(case.matrix)
    matrix[np.ix_(rows, rows)] += 0.05 * abs(coupled.data).max() * np.kron([[1, -1], [-1, 1]], root @ root.T)
    kept = np.flatnonzero(np.repeat(rng.random(len(case.points)) > rng.choice([0.4, 0.5]), 2))
    node = np.unique(kept // 2, return_inverse=True)[1]
    few = rounded(sp.csr_array(matrix)[kept][:, kept], "12 digits")
    found = recover(few, operator="elasticity", numbering=(node, kept % 2))
    assert not found.certified


def test_the_given_matrix_stays_as_it_is():
    case = given(permuted_nodes(stiffness("tri-p1", box("tri-p1", (6, 7)))), "roller", "by component", "stored")
    matrix = rounded(case.matrix, "6 digits")
    before = matrix.copy()
    better, rounding = with_exact_sums(matrix)
    assert rounding.name == "6 digits"
    assert 0.1 * LEVEL["6 digits"] < rounding.level < LEVEL["6 digits"]
    assert abs(matrix - before).max() == 0
    assert 0 < abs(better - matrix).max() < 1e-4 * abs(matrix).max()


@pytest.mark.parametrize("how", ROUNDED)
@pytest.mark.parametrize("make", [frame, plane_frame])
def test_structures_too(make, how):
    case = make()
    found = recover(rounded(case.matrix, how))
    assert found.operator in ("frame or shell", "plane frame")
    assert found.certified
    assert f"rounded to {how}" in found.reason
    assert size_and_error(found.points, case.points) < min(LEVEL[how], found.position_error)


@pytest.mark.parametrize("how", ROUNDED)
def test_trusses_too(how):
    case = truss(3, 40)
    found = recover(rounded(case.matrix, how))
    assert found.operator == "truss"
    assert found.certified
    assert size_and_error(found.points, case.points, scaled=True) < found.position_error


@pytest.mark.parametrize("share", [1e-3, 1e-4, 1e-5, 1e-6])
def test_other_material_does_not_pass_for_rounding(share):
    mesh = box("tri-p1", (10, 9), perturb=0.2)
    unit = np.eye(2)
    tensor = sum(np.einsum(pair, unit, unit) for pair in ("ab,ce->abce", "ac,be->abce", "ae,bc->abce"))
    tensor[0, 0, 0, 0] += share
    case = permuted_nodes(stiffness("tri-p1", mesh, tensor=tensor))
    found = recover(rounded(case.matrix, "6 digits"), operator="elasticity")
    assert found.certified == (share <= 1e-5)
    assert not found.certified or error(found.points, case.points) < found.position_error


def test_full_precision_is_left_alone():
    matrix = stiffness("tri-p1", box("tri-p1", (5, 5), perturb=0.2)).matrix
    same, rounding = with_exact_sums(matrix)
    assert same is matrix
    assert rounding is None
