"""No certificate where equations have no other to check against, or rows of one node are not shown to be one node's."""

import numpy as np
import pytest
from built import PLATE, error, frame, grillage, plane_frame, plate, rows_per_node, shell, sound, truss

from unassemble import recover


def turning(given) -> np.ndarray:
    """Rows of rotations."""
    moves = 1 if given.unknowns == PLATE else given.points.shape[1]
    rows = np.arange(given.matrix.shape[0])
    return rows[rows % given.block >= moves]


@pytest.mark.parametrize("counts", [(4, 3), (3, 2)])
def test_forces_alone_check_nothing_in_a_plane_frame(counts):
    """Springs at rotations take all moments away, so that blocks of members are left; others move the points."""
    given = plane_frame(counts, 1)
    held = given.with_springs(turning(given))
    found = recover(held.matrix)
    assert found.certified
    assert error(found.points, given.points) < 1e-12
    tied = held.with_springs(np.array([0, 4]), np.array([9, 16]))
    assert recover(tied.matrix).status == "uncertified"


@pytest.mark.parametrize("make", [plane_frame, grillage, frame], ids=lambda make: make.__name__)
@pytest.mark.parametrize("off", [0.0, 0.4], ids=["lattice", "out of plumb"])
def test_springs_between_neighbours_earn_no_certificate(make, off):
    """As stiff between all nodes, across one axis; with and without springs at rotations."""
    counts = (3, 2, 2) if make is frame else (3, 2)
    given = make(counts, 1, off)
    for direction in range(given.block - len(turning(given)) // len(given.points)):
        one, other = given.block * given.members.T + direction
        stiff = given.with_springs(one, other, share=0.3)
        assert not sound(stiff.matrix, rows_per_node(given))
        assert not sound(stiff.with_springs(turning(given)).matrix, rows_per_node(given))


@pytest.mark.parametrize(("seed", "ends", "held"), [
    (14, (1, 4), [3, 5, 7]), (16, (0, 1), [3, 6, 8]), (39, (7, 8), [1, 3, 4]), (54, (3, 6), [1, 2, 4]),
    (58, (0, 1), [2, 4, 7]), (77, (0, 3), [4, 5, 7]),
])  # fmt: skip
def test_a_spring_along_a_member_of_a_grillage(seed, ends, held):
    """Its length follows the spring in the forces about both axes, and differences of moments do not tell it."""
    given = grillage((3, 3), seed).with_springs(np.array([3 * ends[0]]), np.array([3 * ends[1]]), share=0.1)
    given = given.clamped(np.isin(np.arange(9), held))
    sound(given.matrix, rows_per_node(given))
    sound(given.permuted(seed).matrix, rows_per_node(given.permuted(seed)))


@pytest.mark.parametrize("axis", [0, 1])
def test_a_lattice_without_rotations_about_an_axis(axis):
    """Condensed unknowns leave forces whole, whose coordinates springs between neighbours change one by one."""
    given = frame((3, 2, 2), off=0.0)
    one, other = 6 * given.members.T + axis
    matrix, kept = given.with_springs(one, other).condensed(np.arange(3, given.matrix.shape[0], 6))
    assert not sound(matrix, rows_per_node(given)[kept], numbering=(kept // 6, kept % 6))


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_equal_springs_all_over_a_lattice(share):
    """In a plate they agree with each other like another length of all cells; members tell their lengths by blocks."""
    given = plate((7, 6), off=0.0)
    inner = given.clamped((given.points == 0).any(axis=1) | (given.points == given.points.max(axis=0)).any(axis=1))
    turned = np.setdiff1d(np.arange(inner.matrix.shape[0]), np.arange(0, inner.matrix.shape[0], 3))
    assert not sound(inner.with_springs(turned, share=share).matrix, rows_per_node(inner))
    given = grillage((6, 4), off=0.0)
    inner = given.clamped((given.points[:, 0] == 0) | (given.points[:, 0] == 15))
    turned = np.arange(2, inner.matrix.shape[0], 3)
    assert sound(inner.with_springs(turned, share=share).matrix, rows_per_node(inner))


@pytest.mark.parametrize("make", [plane_frame, grillage, plate], ids=lambda make: make.__name__)
def test_condensed_unknowns_of_different_nodes(make):
    """Component by component, each one short: rows of different nodes stand in the same place."""
    given = make((4, 3)).permuted(2)
    order = np.arange(given.matrix.shape[0]).reshape(-1, given.block).T.ravel()
    matrix, kept = given.condensed(given.block * np.array([1, 8, 5]) + np.arange(3))
    sorted_rows = np.argsort(np.argsort(order)[kept])
    true = rows_per_node(given)[kept][sorted_rows]
    assert not sound(matrix[sorted_rows][:, sorted_rows], true)


@pytest.mark.parametrize("make", [plane_frame, grillage, plate, frame, shell], ids=lambda make: make.__name__)
@pytest.mark.parametrize("few", [True, False])
def test_rows_of_a_direction_in_another_order(make, few):
    given = make()
    rng = np.random.default_rng(3)
    for direction in range(given.block):
        order = np.arange(given.matrix.shape[0])
        some = order[order % given.block == direction]
        some = rng.choice(some, 2, replace=False) if few else some
        order[some] = rng.permutation(some) if not few else some[::-1]
        assert not sound(given.matrix[order][:, order], rows_per_node(given)[order])


@pytest.mark.parametrize("counts", [(2, 2), (4, 3)])
@pytest.mark.parametrize("direction", [0, 1])
def test_rows_of_a_direction_in_reverse(counts, direction):
    """The graph of a regular frame is the same from the other end."""
    given = plane_frame(counts, off=0.0)
    order = np.arange(given.matrix.shape[0])
    order[direction::3] = order[direction::3][::-1]
    assert not sound(given.matrix[order][:, order], rows_per_node(given)[order])


def test_condensed_truss_is_no_point():
    """A plate none of whose displacements depends on rotations would have all its nodes in one place."""
    given = truss(3, 6)
    matrix, kept = given.condensed(np.array([2, 7, 12]))
    order = np.argsort(kept % 3, kind="stable")
    assert not sound(matrix[order][:, order], given.points[kept // 3][order])


def test_half_a_bar_is_checked_by_others():
    """Of a node on a roller half of each block is left, which is that of a bar whatever its entries."""
    points = np.array([[0, 0], [2, 0.3], [0.4, 2], [2.3, 2.1], [3.9, 0.9]])
    ends = [(0, 1), (0, 2), (1, 2), (1, 3), (2, 3), (3, 4), (1, 4), (0, 3)]
    stiffness = np.zeros((5, 2, 5, 2))
    for i, j in ends:
        along = points[i] - points[j]
        for one, other, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            stiffness[one, :, other] += sign * np.outer(along, along)
    matrix = stiffness.reshape(10, 10)[:9, :9]
    matrix[8, 6] = matrix[6, 8] = 1.5 * matrix[8, 6]
    found = recover(matrix, numbering=(np.arange(9) // 2, np.arange(9) % 2))
    assert found.operator == "truss"
    assert found.certified
    assert np.flatnonzero(found.node_status).tolist() == [4]
    assert error(found.points[:4], points[:4], scaled=True) < 1e-12


@pytest.mark.parametrize(("make", "counts"), [(frame, (3, 3, 3)), (plane_frame, (3, 3)), (grillage, (4, 3))])
def test_regular_frames_are_certified(make, counts):
    """Sums that vanish by symmetry are rounding, and no sign of forces."""
    given = make(counts, off=0.0)
    assert sound(given.matrix, rows_per_node(given))
    given = given.permuted(1)
    assert sound(given.matrix, rows_per_node(given))


@pytest.mark.parametrize(("nodes", "unknowns", "moves"), [(2, 3, 1), (3, 3, 1), (3, 6, 3)])
def test_rows_that_depend_on_each_other_check_nothing(nodes, unknowns, moves):
    """Of low rank, with as many equations as coordinates: any fit, if only their sums vanish."""
    row = np.random.default_rng(0).standard_normal((nodes - 1, nodes, unknowns))
    row[:, -1, :moves] = -row[:, :-1, :moves].sum(axis=1)
    row = row.reshape(nodes - 1, -1)
    assert recover(row.T @ row).status == "uncertified"


def test_the_reason_says_what_the_certificate_covers():
    given = frame()
    found = recover(given.clamped(given.points[:, 2] < 1).matrix)
    assert found.certified
    assert "% of the rows" in found.reason
