"""The certificate of structures by itself: what it says of right points, of wrong ones, and after anchors."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from built import PLANE, PLATE, frame, grillage, plane_frame, plate, shell, truss

from unassemble import recover
from unassemble.certificate import check_bars, check_structure

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


@pytest.mark.parametrize("change", [1e-6, 0.01, 0.5])
def test_a_joint_holds_no_more_than_its_bars_and_springs(change):
    """An entry between the rows of one joint is not given back by any bars, nor by a support."""
    given = truss(3, 30).permuted(1)
    assert recover(given.matrix).certified
    damaged = sp.lil_array(given.matrix)
    damaged[12, 13] = damaged[13, 12] = damaged[12, 13] + change * np.abs(given.matrix[[12]]).max()
    matrix, rows = sp.csr_array(damaged), np.arange(90)
    check = check_bars(matrix, rows // 3, rows % 3, given.points, allowed=1e-9)
    assert check.backward_error > 1e-2 * change
    assert set(check.unexplained.tolist()) <= {12, 13, 14}
    assert not recover(matrix).certified
