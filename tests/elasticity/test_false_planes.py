"""Directions held where no plane across them is: what fits there all the same must not be certified."""

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import box, heterogeneous, on_plane, recover_elasticity, stiffness
from supported import Given, assert_certified, judged, with_zeros

from unassemble.errors import GeometryError


def varying_shear(x):
    return 1 + x[1] + x[0] * x[1]


def body(kind, counts, perturb=0.0, *, varying=False):
    material = {"lam": heterogeneous, "mu": varying_shear} if varying else {"lam": 1.5, "mu": 1.0}
    return stiffness(kind, box(kind, counts, perturb=perturb), **material)


def held(case, gone=(), identity=(), order="interleaved", zeros="stored", *, boundary_first=False, seed=3):
    """Rows of a body of which sides, (axis, value, direction), lack directions, or have rows of the identity."""
    n, d = case.points.shape
    masks = np.zeros((2, n, d), dtype=bool)
    for mask, sides in zip(masks, (gone, identity), strict=True):
        for axis, value, direction in sides:
            mask[on_plane(case, axis, value), direction] = True
    matrix = with_zeros(case.matrix, d, zeros).tocoo()
    lost = (masks[1] & ~masks[0]).ravel()
    entries = (
        np.where(lost[matrix.row] | lost[matrix.col], 0.0, matrix.data) + (matrix.row == matrix.col) * lost[matrix.row]
    )
    matrix = sp.csr_array((entries, (matrix.row, matrix.col)), shape=matrix.shape)
    if zeros == "dropped":
        matrix.eliminate_zeros()
    nodes = np.random.default_rng(seed).permutation(n)
    if boundary_first:
        inside = ((case.points > 0) & (case.points < case.points.max(axis=0))).all(axis=1)
        nodes = nodes[np.argsort(inside[nodes], kind="stable")]
    rows = (nodes[:, None] * d + np.arange(d)).ravel()
    rows = rows[~masks[0].ravel()[rows]]
    if order == "by component":
        rows = rows[np.argsort(rows % d, kind="stable")]
    return Given(sp.csr_array(matrix[rows][:, rows]), rows // d, rows % d, case.points)


X0, X1, Y0, Y1 = ((axis, value, axis) for axis in (0, 1) for value in (0.0, 1.0))


def clamped(side):
    return tuple((side[0], side[1], direction) for direction in (0, 1))


def slide(side):
    """The direction along a side, as no roller has it."""
    return (side[0], side[1], 1 - side[0])


@pytest.mark.parametrize(
    ("case", "gone", "identity"),
    [
        (body("quad-q2", (4, 5), varying=True), (Y0, *clamped(Y1)), (slide(X1),)),
        (body("quad-q2", (4, 4)), (*clamped(X0), slide(Y1)), ()),
        (body("quad-s2", (4, 4)), (*clamped(X0), slide(Y0)), ()),
        (body("quad-q1", (4, 4), 0.2, varying=True), (*clamped(X1), slide(Y0)), ()),
        (body("tri-p2", (4, 4)), (slide(Y0),), (Y1,)),
        (body("tri-p2", (4, 3)), clamped(X0), (slide(X1),)),
        (body("tri-p1", (6, 6), varying=True), (), (*clamped(X0), slide(X1), Y1)),
    ],
    ids=["quad-q2 varying", "quad-q2", "quad-s2", "quad-q1", "tri-p2", "tri-p2 clamped", "tri-p1"],
)
@pytest.mark.parametrize("order", ["interleaved", "by component"])
def test_planes_that_fit_by_chance_are_not_certified(case, gone, identity, order):
    """In the plane there are hardly more equations next to rollers than coordinates: garbage fits them exactly."""
    case = held(case, gone, identity, order)
    try:
        found = recover_elasticity(case.matrix)
    except GeometryError:  # a null space far too large
        return
    if found.certified:
        assert judged(found, case).error < 1e-8
    else:
        assert any(why in found.reason for why in ("no elements show", "inferred", "null space is larger"))


def test_a_homogeneous_body_whose_axes_planes_alone_tell_is_certified_by_elements_only():
    case = held(body("tri-p2", (4, 4)), (slide(Y0),), (Y1,), seed=1)
    found = recover_elasticity(case.matrix)
    assert found.status == "uncertified"
    assert "no elements show that they do" in found.reason


@pytest.mark.parametrize("zeros", ["stored", "dropped"])
@pytest.mark.parametrize("order", ["interleaved", "by component"])
def test_false_planes_of_a_body_held_all_around(order, zeros):
    """Elements tell its axes; they do not show where the nodes along the false plane are."""
    case = held(body("tri-p1", (7, 7), 0.2), (slide(X0), X1, Y0, Y1), (), order, zeros)
    assert_certified(case, 1e-8, 0.6)


@pytest.mark.parametrize("seed", [6, 19])
def test_rows_on_both_sides_of_a_row_of_the_identity_are_not_one_node_for_certain(seed):
    """Boundary first: single rows of nodes of two rollers, between them a row of the identity that one of them lost."""
    case = held(body("quad-q1", (5, 5)), (Y1,), (X1,), zeros="dropped", boundary_first=True, seed=seed)
    found = recover_elasticity(case.matrix)
    assert found.certified
    assert judged(found, case).error < 1e-8
