"""The certificate of structures by itself: what it says of right points, of wrong ones, and after anchors."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from built import PLANE, PLATE, frame, grillage, plane_frame, plate, shell, truss, vault

from unassemble import recover
from unassemble.certificate import check_bars, check_structure
from unassemble.nodes import Known, known_to, with_exact_sums

AXES = {6: ((0, 1, 2), (0, 1, 2)), PLANE: ((0, 1), (2,)), PLATE: ((2,), (0, 1))}
MAKE = [frame, plane_frame, grillage, plate, shell]


def checked(given, points=None, matrix=None, members=True, **options):
    """The certificate of points of a structure whose rows stand node by node."""
    rows = np.arange(given.matrix.shape[0])
    displacements, rotations = AXES[6 if given.block == 6 else given.unknowns]
    return check_structure(
        given.matrix if matrix is None else sp.csr_array(matrix),
        rows // given.block,
        rows % given.block,
        given.points if points is None else points,
        displacements,
        rotations,
        members=np.sort(given.members, axis=1) if members else np.empty((0, 2), np.int64),
        allowed=1e-9,
        **options,
    )


@pytest.mark.parametrize("make", MAKE, ids=lambda make: make.__name__)
def test_true_points_are_explained(make):
    given = make().permuted(1)
    found = checked(given)
    assert found.backward_error < 1e-12
    assert not len(found.unexplained)
    assert found.share == 1.0 or (make is shell and found.share > 0.5)


@pytest.mark.parametrize("make", MAKE, ids=lambda make: make.__name__)
@pytest.mark.parametrize("how", ["one node", "size", "one axis"])
def test_wrong_points_are_not(make, how):
    given = make().permuted(1)
    points = given.points.copy()
    if how == "one node":
        points[3, 0] += 1e-5
    elif how == "size":
        points *= 1 + 1e-5
    else:
        points[:, 1] *= 1 + 1e-5
    for members in (True, False):
        found = checked(given, points, members=members)
        assert found.backward_error > 1e-8
        assert len(found.unexplained)


def test_soft_rows_count_as_much_as_stiff_ones():
    """A spring between two nodes of a structure that is a million million times softer than another one beside it."""
    given = frame().permuted(1)
    order, (i, j) = given.matrix.shape[0], 6 * given.members[0]
    value = 1e-3 * given.matrix[i, i]
    spring = sp.csr_array(([value, value, -value, -value], ([i, j, i, j], [i, j, j, i])), shape=given.matrix.shape)
    both = sp.block_diag([given.matrix, 1e-12 * (given.matrix + spring)], format="csr")
    members = np.empty((0, 2), np.int64)
    twice = replace(given, matrix=both, points=np.tile(given.points, (2, 1)), members=members)
    found = checked(twice)
    assert found.backward_error > 1e-6
    assert set(found.unexplained.tolist()) <= {order + i, order + j}
    assert len(found.unexplained)


def test_springs_against_drilling_are_explained_and_others_are_not():
    given = frame().permuted(1)
    node = 5
    spring = np.zeros((6, 6))
    spring[3:, 3:] = 1e6 * np.diag([1.0, 2.0, 3.0])
    rows = 6 * node + np.arange(6)
    place = np.repeat(rows, 6), np.tile(rows, 6)
    drilled = given.matrix + sp.csr_array((spring.ravel(), place), shape=given.matrix.shape)
    found = checked(given, matrix=drilled, members=False)
    assert not len(found.unexplained)
    assert not found.rows[rows[3:]].any()
    i, j = rows[0], 6 * int(given.members[given.members[:, 0] == node][0, 1])
    across = sp.csr_array(([1e6, 1e6, -1e6, -1e6], ([i, j, i, j], [i, j, j, i])), shape=given.matrix.shape)
    found = checked(given, matrix=given.matrix + across, members=False)
    assert set(found.unexplained.tolist()) <= {i, j}
    assert len(found.unexplained)
    excused = checked(given, matrix=given.matrix + across, members=False, excused=np.array([i // 6, j // 6]))
    assert not len(excused.unexplained)


def test_rows_next_to_supports_say_nothing():
    given = shell().clamped(np.arange(63) < 7)
    found = checked(given)
    assert found.backward_error < 1e-12
    assert not found.rows[: 6 * 7].any()


def test_bars():
    given = truss(3, 30).permuted(1)
    rows = np.arange(90)
    assert check_bars(given.matrix, rows // 3, rows % 3, given.points, allowed=1e-9).backward_error < 1e-12
    moved = given.points.copy()
    moved[4] += 1e-5
    found = check_bars(given.matrix, rows // 3, rows % 3, moved, allowed=1e-9)
    assert found.backward_error > 1e-7
    assert set(range(12, 15)) & set(found.unexplained.tolist())


def bars_of(given, matrix=None):
    """The certificate of the joints of a truss whose rows stand joint by joint."""
    rows = np.arange(given.matrix.shape[0])
    matrix = given.matrix if matrix is None else sp.csr_array(matrix)
    return check_bars(matrix, rows // given.block, rows % given.block, given.points, allowed=1e-9)


def entry(order, row, column, value):
    """A symmetric matrix of one number."""
    one = sp.coo_array(([value], ([row], [column])), shape=(order, order))
    return sp.csr_array(one + one.T) if row != column else sp.csr_array(one)


@pytest.mark.parametrize("size", [1e-6, 0.01, 0.5])
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("held", [None, 1e2, 1e10])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_wrong_entry_between_the_rows_of_a_joint_is_no_bar(d, size, held, sign):
    given = truss(d, 25).permuted(1)
    matrix, order, k = given.matrix, d * 25, 12 * d
    largest = abs(matrix[k, : 12 * d]).max()
    matrix = matrix + entry(order, k, k + 1, size * largest)
    if held:  # by a penalty
        matrix = matrix + entry(order, k, k, held * largest)
    found = bars_of(given, sign * matrix)
    assert found.backward_error > 1e-9
    assert {k, k + 1} <= set(found.unexplained.tolist())
    assert not found.rows[[k, k + 1]].any()
    assert recover(sign * matrix).status != "certified"


def test_supports_of_a_truss_are_explained_and_their_rows_do_not_count():
    given = truss(2, 25).permuted(1)
    order = given.matrix.shape[0]
    largest = abs(given.matrix).max()
    block = np.array([[2.0, 1.0], [1.0, 1.0]]) * largest  # springs across the axes
    place = np.repeat([8, 9], 2), np.tile([8, 9], 2)
    sprung = given.matrix + sp.csr_array((block.ravel(), place), shape=(order, order))
    for matrix, rows in (
        (given.matrix + entry(order, 8, 8, 1e10 * largest), [8]),
        (given.matrix + entry(order, 8, 8, 0.1 * largest), [8]),
        (sprung, [8, 9]),
    ):
        found = bars_of(given, matrix)
        assert found.backward_error < 1e-12
        assert not len(found.unexplained)
        assert np.flatnonzero(~found.rows).tolist() == rows
        assert recover(matrix).status == "certified"


@pytest.mark.parametrize("digits", [None, 12, 8])
@pytest.mark.parametrize("keep", [[0], [1], []])
def test_joints_next_to_supports_that_were_taken_out_are_explained(keep, digits):
    given = truss(2, 30, 3)
    rows = np.arange(60)
    left = rows[(rows // 2 >= 4) | np.isin(rows % 2, keep)]
    matrix = sp.csr_array(given.matrix[left][:, left])
    if digits:
        matrix.data = np.array([float(f"{x:.{digits - 1}e}") for x in matrix.data])
    allowed = 1e-9 if digits is None else 10.0 ** (2 - digits)
    found = check_bars(matrix, left // 2, left % 2, given.points, allowed=max(allowed, 1e-9))
    assert found.backward_error < max(allowed, 1e-12)
    assert not len(found.unexplained)
    assert 0.3 < found.share < 1


def test_nothing_is_compared_where_no_two_joints_have_positions():
    given = truss(2, 25)
    alone = given.points.copy()
    alone[1:] = np.nan
    rows = np.arange(50)
    found = check_bars(given.matrix, rows // 2, rows % 2, alone, allowed=1e-9)
    assert np.isnan(found.backward_error)
    assert not found.rows.any()


@pytest.mark.parametrize("make", [frame, lambda: truss(3, 40)])
def test_the_backward_error_is_that_of_points_after_anchors(make):
    given = make()
    near = recover(given.matrix, anchors=[(given.block * k, *given.points[k]) for k in (0, 5)])
    far = recover(given.matrix, anchors=[(given.block * k, *(given.points[k] + 1e5)) for k in (0, 5)])
    assert near.backward_error < 1e-13
    assert 1e-13 < far.backward_error < 1e-9
    assert far.certified


def test_rows_that_are_not_explained_are_named():
    given = plane_frame((3, 2), 1)
    rows = np.arange(given.matrix.shape[0])
    held = given.with_springs(rows[rows % 3 == 2])
    tied = held.with_springs(np.array([0, 4]), np.array([9, 16]))
    found = recover(tied.matrix)
    assert found.status == "uncertified"
    assert "in row" in found.reason


def test_one_thing_is_said_once():
    """A frame some of whose entries are wrong, so that no row annihilates all rotations."""
    matrix = sp.coo_array(plane_frame().matrix)
    wrong = np.flatnonzero(matrix.row < matrix.col)[::40]
    for row, column, value in zip(matrix.row[wrong], matrix.col[wrong], matrix.data[wrong], strict=True):
        matrix = matrix + entry(matrix.shape[0], row, column, 0.3 * value)
    found = recover(matrix)
    assert found.status == "uncertified"
    assert 0 < found.backward_error < np.inf
    reasons = found.verdict.reasons
    assert len({one[:30] for one in reasons}) == len(reasons)
    assert not any("inf" in one.split() or "nan" in one or "..." in one for one in reasons)
    assert "and others" in reasons[0]


@pytest.mark.parametrize("error", [np.nan, np.inf])
def test_positions_that_nothing_tells_are_an_objection(error):
    (reason,) = Known(error).objections(0.0, None, "rigid rotations cause no forces")
    assert str(reason) == "rigid rotations cause no forces, and positions may be off by any distance"


def test_rows_that_are_all_excused_are_nothing_to_compare_with():
    given = frame().permuted(1)
    found = checked(given, excused=np.arange(len(given.points)))
    assert np.isnan(found.backward_error)
    assert not found.rows.any()


def test_anchors_beyond_all_digits_are_an_objection():
    given = frame()
    with np.errstate(all="ignore"):
        found = recover(given.matrix, anchors=[(0, *(given.points[0] + 1e300))])
    assert found.status == "uncertified"


def test_a_piece_of_one_node_is_where_it_is():
    """Of a node by itself nothing is off, whatever other numbers do to the rest."""
    given = frame((2, 2, 2))
    matrix = sp.csr_array(given.matrix)
    matrix.data = np.array([float(f"{x:.9e}") for x in matrix.data])
    _, rounding = with_exact_sums(matrix)
    assert rounding is not None
    points = np.vstack([given.points, np.zeros((1, 3))])
    component = np.append(np.zeros(len(given.points), np.int64), 1)
    known = known_to(points, component, np.zeros(3), rounding, lambda _: (points, np.zeros(3)), sized=True)
    assert known.error == 0


@pytest.mark.parametrize("make", [frame, plane_frame], ids=lambda make: make.__name__)
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("share", [0.3, -0.3, 1e-6])
@pytest.mark.parametrize("clamped", [False, True])
def test_entries_that_no_support_leaves_are_an_objection(make, sign, share, clamped):
    """Between displacements of two nodes, along different axes: of nodes without a member, and with one."""
    given = make().permuted(1)
    if clamped:
        given = given.clamped(given.points[:, -1] < given.points[:, -1].min() + 0.3)
    block, order = given.block, given.matrix.shape[0]
    moved = given.matrix @ (np.arange(order)[:, None] % block == np.arange(2))
    still = np.abs(moved).reshape(-1, 2 * block).max(axis=1) < 1e-6 * abs(given.matrix).max()
    pairs = [(int(i), int(j)) for i, j in given.members if still[i] and still[j]]
    first = pairs[0][0]
    apart = set(np.flatnonzero(still).tolist()) - set(given.members[(given.members == first).any(axis=1)].ravel())
    for i, j in (pairs[0], (first, max(apart))):
        wrong = share * given.matrix[block * i, block * i]
        matrix = sign * (given.matrix + entry(order, block * i, block * j + 1, wrong))
        others = given.members[~np.isin(given.members, (i, j)).all(axis=1)]
        found = checked(replace(given, members=others), matrix=matrix)
        assert {block * i, block * j + 1} <= set(found.unsupported.tolist())
        assert recover(matrix).status != "certified"


@pytest.mark.parametrize("make", [*MAKE, lambda: vault()], ids=lambda make: make.__name__)
@pytest.mark.parametrize("sign", [1, -1])
def test_supports_and_springs_leave_what_they_may(make, sign):
    given = make().permuted(1)
    order = given.matrix.shape[0]
    rng = np.random.default_rng(1)
    held = rng.choice(order, 9, replace=False)
    stiff = float(abs(given.matrix).max())
    rollers = sp.csr_array(given.matrix + sp.diags_array(np.isin(np.arange(order), held) * 1e8 * stiff))
    springs = given.with_springs(held[:4], held[4:8]).matrix
    for matrix in (given.matrix, rollers, springs):
        assert not len(checked(given, matrix=sign * matrix, members=matrix is not springs).unsupported)
    left = np.setdiff1d(np.arange(order), held)
    displacements, rotations = AXES[6 if given.block == 6 else given.unknowns]
    found = check_structure(
        sp.csr_array(sign * given.matrix[left][:, left]),
        left // given.block,
        left % given.block,
        given.points,
        displacements,
        rotations,
        members=np.sort(given.members, axis=1),
        allowed=1e-9,
    )
    assert not len(found.unsupported)
