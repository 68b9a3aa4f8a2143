"""Supports that leave no trace in translations, pieces that are many, bars that contradict each other."""

from itertools import combinations

import numpy as np
import pytest
import scipy.sparse as sp
from as_given import written
from built import (
    add_members,
    assembled,
    error,
    frame,
    grid,
    model_on,
    plane_frame,
    plate,
    rows_per_node,
    shell,
    sound,
    truss,
)

from unassemble import RecoveryError, recover
from unassemble.structures import pieces


def rows_of(given, kept):
    rows = np.flatnonzero(np.repeat(kept, given.block))
    return given.matrix[rows][:, rows], {"numbering": (rows // given.block, rows % given.block)}


def test_torsion_of_eliminated_columns_spoils_no_certificate():
    """Two equal columns resist the rotation of a beam's ends about the vertical, and show in no row of that moment.

    No row is whole; the block of the beam tells its length all the same.
    """
    points, ends = grid((1, 2, 2))
    model = model_on(2 * points)
    model.add_section("all", 1e-2, 1e-4, 1e-4, 2.5e-4)
    for k, (i, j) in enumerate(ends):
        model.add_member(str(k), str(i), str(j), "steel", "all")
    given = assembled(model, 2 * points, ends)
    matrix, numbering = rows_of(given, given.points[:, 2] == 0)
    found = recover(matrix, **numbering)
    assert found.certified
    np.testing.assert_allclose(np.abs(found.points[1] - found.points[0]), [0, 2, 0], atol=1e-12)


def test_springs_are_noticed_or_nothing_is_certified():
    """Rotations tied to the ground in plane frames, of which supports leave hardly more rows than unknowns."""
    certified = 0
    for seed in range(25):
        rng = np.random.default_rng(seed)
        given = plane_frame((5, 3), seed)
        rows = np.flatnonzero(np.repeat(rng.random(15) > 0.15, 3))
        turning = (rows % 3 == 2) & (rng.random(len(rows)) < 0.3)
        matrix = given.matrix[rows][:, rows]
        matrix = matrix + sp.diags_array(np.where(turning, 0.3 * matrix.diagonal(), 0.0))
        try:
            found = recover(matrix, numbering=(rows // 3, rows % 3))
        except RecoveryError:
            continue
        if found.certified:
            certified += 1
            true = np.full((len(found.points), 2), np.nan)
            true[found.node_of_row] = given.points[rows // 3]
            for piece in range(found.n_components):
                here = found.component == piece
                assert error(found.points[here], true[here]) < 1e-6
    assert certified


@pytest.mark.arithmetic
@pytest.mark.parametrize("size", [1e-6, 1e-7, 1e-8, 1e-9])
@pytest.mark.parametrize("make", [plate, shell, frame])
def test_springs_hardly_above_rounding_do_not_pass_for_it(make, size):
    """Between all coupled nodes alike, which moves positions far more than rounding does: as close as said, or not."""
    given = make().permuted(1)
    ends = np.unique(np.column_stack(sp.triu(abs(given.matrix)).nonzero()) // given.block, axis=0)
    ends = given.block * ends[ends[:, 0] < ends[:, 1]]
    matrix = written(given.with_springs(ends[:, 0], ends[:, 1], share=size).matrix, 8)
    sound(matrix, rows_per_node(given))


@pytest.mark.parametrize("make", [lambda: frame((2, 2, 2)), lambda: truss(3, 12)], ids=["frame", "truss"])
def test_many_pieces(make):
    given = make()
    found = recover(sp.block_diag([given.matrix] * 12, format="csr"), block_size=given.block)
    assert found.certified
    assert found.n_components == 12
    scaled = given.block == 3
    for points in found.points.reshape(12, -1, 3):
        assert error(points, given.points, scaled=scaled) < 1e-10


def test_pieces_share_nothing():
    operator = sp.csr_array(np.array([[1.0, 0, 0, 0, -1, 0], [0, 0, 0, 2, 0, 0], [0, 3, 0, 0, 0, -3]]))
    found = list(pieces(operator, 2, np.array([[0, 2], [0, 1]])))
    assert [piece.nodes.tolist() for piece in found] == [[0, 2], [1]]
    assert [piece.rows.tolist() for piece in found] == [[0, 2], [1]]
    assert found[0].edges.tolist() == [[0, 1]]
    np.testing.assert_array_equal(found[0].operator.toarray(), [[1, 0, -1, 0], [0, 3, 0, -3]])


def test_bars_that_meet_nowhere_have_no_length():
    """A triangle two of whose sides are parallel shrinks to a point beside a sound one: no truss has these blocks."""
    angles = np.radians([0, 60, 120, 0, 0, 90])
    ends = np.array([[0, 1], [0, 2], [1, 2], [2, 3], [3, 4], [2, 4]])
    stiffness = np.zeros((5, 2, 5, 2))
    for (i, j), angle in zip(ends, angles, strict=True):
        e = np.array([np.cos(angle), np.sin(angle)])
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            stiffness[a, :, b] += sign * np.outer(e, e)
    found = recover(stiffness.reshape(10, 10), numbering="interleaved", block_size=2)
    assert found.operator == "truss"
    assert found.status == "uncertified"
    assert found.backward_error > 1e-3


def test_directions_of_nearly_loose_bars_are_held_to_their_accuracy():
    """Two braced squares, hardly different, tied by bars almost parallel and disturbed within the tolerance."""
    square = np.array([[0, 0], [1, 0.1], [0.4, 1], [-0.7, 0.6]])
    points = np.concatenate([square, square + [[5, 0], [5, 1e-6], [5, 0], [5, -1e-6]]])
    pairs = np.array(list(combinations(range(4), 2)))
    ends = np.concatenate([pairs, 4 + pairs, np.column_stack([np.arange(4), np.arange(4, 8)])])
    along = points[ends[:, 1]] - points[ends[:, 0]]
    along += 1e-10 * np.random.default_rng(0).standard_normal(along.shape)
    stiffness = np.zeros((8, 2, 8, 2))
    for (i, j), e in zip(ends, along, strict=True):
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            stiffness[a, :, b] += sign * np.outer(e, e)
    found = recover(stiffness.reshape(16, 16), numbering="interleaved", block_size=2)
    assert found.operator == "truss"
    assert error(found.points, points, scaled=True) > 1e-6
    assert found.status == "uncertified"
    assert "positions may be off" in found.reason


def test_a_frame_with_supports_is_no_solid_of_points_in_a_line():
    """Single unknowns of a small frame are gone; read as a solid, all nodes but one would lie in one point."""
    points, ends = grid((3, 3))
    points = 2 * points + np.random.default_rng(0).uniform(-0.4, 0.4, points.shape)
    model = model_on(points)
    model.add_section("all", 1e-2, 1e-4, 1e-4, 2.5e-4)
    for k, (i, j) in enumerate(ends):
        model.add_member(str(k), str(i), str(j), "steel", "all")
    given = assembled(model, points, ends).only((0, 1, 5), 2)
    kept = np.array([0, 1, 3, 4, 5, 7, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 22, 23, 24, 25, 26])
    with pytest.raises(RecoveryError):
        recover(given.matrix[kept][:, kept])


def test_joints_in_one_place_prove_nothing():
    """Of a truss one row of a joint and two of another are gone: it is no plate of joints that coincide."""
    seed = 981151
    given = truss(3, 7, seed).permuted(seed)
    kept = np.setdiff1d(np.arange(21), [4, 6, 7])
    assert recover(given.matrix[kept][:, kept]).status == "uncertified"


def warren():
    """A truss without a bar to spare."""
    points = np.column_stack([np.arange(6.0), np.arange(6) % 2 * 0.8])
    points += np.random.default_rng(0).uniform(-0.2, 0.2, points.shape)
    ends = np.array([(i, i + step) for i in range(6) for step in (1, 2) if i + step < 6])
    model = model_on(points)
    add_members(model, ends, 0, pinned=True)
    return assembled(model, points, ends).only(range(2), 2)


@pytest.mark.parametrize("held", [[], [0, 1, 10]], ids=["free", "supported"])
def test_a_determinate_truss(held):
    """At the pin and the roller the diagonal blocks of neighbours leave a bar over."""
    given, kept = warren(), np.setdiff1d(np.arange(12), held)
    found = recover(given.matrix[kept][:, kept], numbering=(kept // 2, kept % 2))
    known = found.node_status == 0
    assert found.certified
    assert known.sum() >= len(known) - 1
    assert error(found.points[known], given.points[np.unique(kept // 2)][known], scaled=True) < 1e-10


@pytest.mark.parametrize("what", ["signs", "one entry"])
def test_diagonal_blocks_contradict_wrong_bars_of_a_determinate_truss(what):
    """Any directions fit some joints."""
    given = warren()
    upper = sp.triu(given.matrix, 1).tocoo()
    last = (upper.row == 9) & (upper.col == 11)
    upper.data = -np.abs(upper.data) if what == "signs" else np.where(last, 1e12, 1) * upper.data
    damaged = upper + upper.T + sp.diags_array(given.matrix.diagonal())
    found = recover(damaged, numbering="interleaved", block_size=2)
    known = found.node_status == 0
    assert found.operator == "truss"
    assert not found.certified or error(found.points[known], given.points[known], scaled=True) < 1e-10
