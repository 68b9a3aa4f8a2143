"""Coordinates of frames, shells, plates and trusses from their matrices alone."""

import numpy as np
import pytest
import scipy.sparse as sp
from built import add_members, assembled, cells_of, error, flat, frame, model_on, plane_frame, plate, shell, truss

from unassemble import InputError, RecoveryError, inspect_matrix, recover
from unassemble_demo import mast

CASES = {
    "frame": (frame, "frame or shell", 2),
    "shell": (shell, "frame or shell", 2),
    "flat shell": (lambda: shell(flat), "frame or shell", 0),
    "thin shell": (lambda: shell(thickness=1e-3), "frame or shell", 2),
    "plane frame": (plane_frame, "plane frame", 1),
    "plate": (plate, "plate", 0),
}


def lowest(points, axis):
    return points[:, axis] < points[:, axis].min() + 0.9


@pytest.mark.parametrize("clamped", [False, True], ids=["free", "clamped"])
@pytest.mark.parametrize("name", CASES)
def test_coordinates_come_in_true_size(name, clamped):
    make, operator, axis = CASES[name]
    given = make()
    if clamped:
        given = given.clamped(lowest(given.points, axis))
    given = given.permuted(3)
    found = recover(given.matrix)
    assert found.certified, found.reason
    assert found.operator == operator
    assert found.node_status.sum() <= 1  # a corner all of whose neighbours lie at the support
    assert error(found.points, given.points) < 1e-10
    assert all(one.null_dimension == given.points.shape[1] and one.gap > 1e-7 for one in found.evidence)


@pytest.mark.parametrize("name", ["frame", "shell", "plane frame", "plate"])
def test_unknowns_by_component(name):
    given = CASES[name][0]().permuted(1)
    found = recover(given.by_component())
    assert found.certified
    assert found.numbering == "by component"
    assert error(found.points, given.points) < 1e-10


def test_members_are_told_from_shells():
    given = frame().permuted(2)
    found = recover(given.matrix)
    assert len(found.quads) == len(found.triangles) == 0
    assert {frozenset(pair) for pair in found.lines.tolist()} == {frozenset(pair) for pair in given.members.tolist()}
    given = shell()
    found = recover(given.matrix)
    assert not len(found.lines)
    assert len(found.quads) == 8 * 6
    wanted = {frozenset(cell) for cell in cells_of((9, 7)).tolist()}
    assert {frozenset(cell) for cell in found.quads.tolist()} == wanted
    length = np.linalg.norm(np.diff(found.points[found.quads], axis=1, append=found.points[found.quads[:, :1]]), axis=2)
    assert length.max() < 1.05  # sides, no diagonals


@pytest.mark.parametrize(("d", "n"), [(2, 60), (3, 80)])
@pytest.mark.parametrize("clamped", [False, True])
def test_trusses(d, n, clamped):
    given = truss(d, n)
    if clamped:
        given = given.clamped(given.points[:, 0] < 0.15)
    given = given.permuted(4)
    found = recover(given.matrix, operator="elasticity")
    assert found.certified, found.reason
    assert found.operator == "truss"
    assert error(found.points, given.points, scaled=True) < 1e-11
    assert {frozenset(pair) for pair in found.lines.tolist()} == {frozenset(pair) for pair in given.members.tolist()}


@pytest.mark.parametrize("d", [2, 3])
def test_a_truss_needs_no_row_away_from_supports(d):
    given = truss(d, 60)
    held = np.random.default_rng(1).random(60) < (0.2 if d == 2 else 0.4)
    given = given.clamped(held).permuted(2)
    found = recover(given.matrix, operator="elasticity")
    assert found.certified
    pieces = [found.component == k for k in range(found.n_components)]
    assert sum(map(np.sum, pieces)) > 0.8 * len(given.points)
    assert all(error(found.points[here], given.points[here], scaled=True) < 1e-10 for here in pieces)


def test_a_roller_hides_no_bar():
    given = truss(3, 80)
    gone = 3 * np.flatnonzero(given.points[:, 2] < 0.2) + 2
    kept = np.setdiff1d(np.arange(given.matrix.shape[0]), gone)
    found = recover(given.matrix[kept][:, kept], numbering=(kept // 3, kept % 3))
    assert found.status == "certified"
    assert found.operator == "truss"
    assert error(found.points, given.points, scaled=True) < 1e-11


def test_an_unbraced_truss_is_no_answer():
    """A row of squares without diagonals: the uprights may lean, whatever the bars say of their lengths."""
    points = np.array([[x, y] for x in range(6) for y in range(2)], dtype=float)
    rows = [(2 * k, 2 * k + 1) for k in range(6)] + [(2 * k + s, 2 * k + 2 + s) for k in range(5) for s in (0, 1)]
    stiffness = np.zeros((12, 2, 12, 2))
    for i, j in rows:
        along = points[j] - points[i]
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            stiffness[a, :, b] += sign * np.outer(along, along)
    matrix = sp.csr_array(stiffness.reshape(24, 24) + np.diag(np.full(24, 1e-3)))
    with pytest.raises(RecoveryError):
        recover(matrix, numbering="interleaved", block_size=2)


def test_a_plate_with_five_unknowns_per_node():
    """Bending and stretching are not coupled; nodes are those of both, and what is certified is bending."""
    given = shell(lambda u, v: np.column_stack([u, 1.1 * v, 0 * u]), (13, 11)).only(range(5), 3)
    given = given.clamped(lowest(given.points, 0)).permuted(1)
    found = recover(given.matrix)
    assert found.certified
    assert found.operator == "plate"
    assert found.n_points == len(given.points)
    assert found.node_of_row.tolist() == np.repeat(np.arange(len(given.points)), 5).tolist()
    known = np.isfinite(found.points).all(axis=1)
    assert known.mean() > 0.8
    assert error(found.points[known], given.points[known][:, :2]) < 1e-10
    assert int(found.reason.split(": ")[-1].split("%")[0]) <= 60


def test_given_numbering_with_pinned_supports():
    """Displacements of the lowest nodes are gone, their rotations are not."""
    given = frame()
    low = np.flatnonzero(lowest(given.points, 2))
    gone = (6 * low[:, None] + np.arange(3)).ravel()
    kept = np.setdiff1d(np.arange(given.matrix.shape[0]), gone)
    found = recover(given.matrix[kept][:, kept], numbering=(kept // 6, kept % 6))
    assert found.certified
    assert found.numbering == "given"
    assert error(found.points, given.points) < 1e-10


def test_a_straight_beam_is_no_planar_mesh():
    """Its unknowns fall apart into paths and ladders."""
    points = np.array([[0.0, 0.0, z] for z in (0, 1, 2.5, 3, 4.2, 5)])
    model = model_on(points)
    add_members(model, [(k, k + 1) for k in range(5)], 0, turned=False)
    found = recover(assembled(model, points).matrix)
    assert found.certified
    assert found.operator == "frame or shell"
    assert error(found.points, points) < 1e-12


@pytest.mark.parametrize("make", [frame, plane_frame])
def test_pins_are_found_by_the_pattern(make):
    given = make()
    low = np.flatnonzero(lowest(given.points, given.points.shape[1] - 1))
    d = 3 if given.block == 6 else 2
    gone = (given.block * low[:, None] + np.arange(d)).ravel()
    kept = np.setdiff1d(np.arange(given.matrix.shape[0]), gone)
    found = recover(given.matrix[kept][:, kept])
    assert found.certified
    assert sorted(np.flatnonzero(found.node_status)) == sorted(low)
    assert error(found.points, given.points) < 1e-10
    assert any("does not tell" in note for note in found.warnings)
    np.testing.assert_array_equal(found.node_of_row, kept // given.block)
    told = found.direction_of_row >= 0
    np.testing.assert_array_equal(found.direction_of_row[told], (kept % given.block)[told])
    assert not found.rigid_body_modes()[~told].any()
    found.to_meshio()


def test_identity_rows_and_penalties():
    given = frame()
    low = np.flatnonzero(lowest(given.points, 2))
    held = (6 * low[:, None] + np.arange(6)).ravel()
    matrix = given.matrix.tolil()
    matrix[held, :] = 0
    matrix[:, held] = 0
    matrix[held, held] = 1
    found = recover(matrix.tocsr())
    assert found.certified
    assert sorted(np.flatnonzero(found.node_status)) == sorted(low)
    assert error(found.points, given.points) < 1e-10
    stiff = np.zeros(given.matrix.shape[0])
    stiff[held] = 1e6 * given.matrix.diagonal().max()
    found = recover(given.matrix + sp.diags_array(stiff))
    assert found.certified
    assert error(found.points, given.points) < 1e-10


def test_anchors_move_and_do_not_stretch():
    given = frame()
    x = given.points + [10.0, 20.0, 30.0]
    found = recover(given.matrix, anchors=[(0, *x[0])])
    np.testing.assert_allclose(found.points, x, atol=1e-9)
    found = recover(given.matrix, anchors=[(0, 0, 0, 0), (6, 99, 0, 0)])
    assert any("anchors do not fit" in note for note in found.warnings)
    with pytest.raises(InputError, match="3 finite coordinates"):
        recover(given.matrix, anchors=[(0, 1.0, 2.0)])


@pytest.mark.parametrize("make", [frame, lambda: truss(3, 40)])
def test_anchors_far_away_cost_digits(make):
    given = make()
    d = given.points.shape[1]
    for shift, status in ((1e3, "certified"), (1e10, "uncertified")):
        found = recover(given.matrix, anchors=[(given.block * k, *(given.points[k] + shift)) for k in (0, 5)])
        assert found.status == status, found.reason
        assert found.dim == d
        assert ("too few digits" in found.reason) == (status == "uncertified")


def test_rigid_modes_cost_nothing():
    for make in (frame, plane_frame):
        given = make().permuted(5)
        modes = recover(given.matrix).rigid_body_modes()
        assert modes.shape == (given.matrix.shape[0], given.block)
        force = abs(given.matrix @ modes).max() / (abs(given.matrix) @ abs(modes)).max()
        assert force < 1e-12
        assert np.linalg.matrix_rank(modes) == given.block


def test_inspection_names_structures():
    for make, operator in (
        (frame, "frame or shell: "),
        (plane_frame, "plane frame: "),
        (lambda: truss(3, 40), "truss: "),
    ):
        facts = inspect_matrix(make().matrix)
        assert facts.operator.startswith(operator)
        assert facts.recoverable.startswith(f"coordinates of {facts.n_nodes} nodes")


def test_a_wrong_entry_spoils_the_certificate_of_its_nodes():
    given = frame()
    matrix = given.matrix.tolil()
    row, column = 40, int(given.matrix[[40]].indices[2])
    matrix[row, column] *= 1.01
    matrix[column, row] = matrix[row, column]
    found = recover(matrix.tocsr())
    assert found.certified
    assert error(found.points, given.points) < 1e-12
    (note,) = (one for one in found.warnings if "contradict the others" in one)
    assert note.split(" (")[1].split(")")[0] in (str(row // 6), str(column // 6))
    assert "100% of the rows" not in found.reason


def test_several_structures_in_one_matrix():
    one, other = frame((3, 2, 2)), shell(counts=(5, 4))
    found = recover(sp.block_diag([one.matrix, other.matrix], format="csr"))
    assert found.certified
    assert found.n_components == 2
    n = len(one.points)
    assert error(found.points[:n], one.points) < 1e-10
    assert error(found.points[n:], other.points) < 1e-10


def test_files_and_pictures(tmp_path):
    import meshio

    found = recover(frame().matrix)
    found.save(tmp_path / "frame.vtu")
    read = meshio.read(tmp_path / "frame.vtu")
    assert {block.type for block in read.cells} == {"line"}
    assert {"row_x", "row_rz"} <= set(read.point_data)
    found.save(tmp_path / "frame.npz")
    assert np.load(tmp_path / "frame.npz")["lines"].shape == found.lines.shape
    found.plot(tmp_path / "frame.png")
    recover(shell().matrix).plot(tmp_path / "shell.svg")
    report = found.report()
    assert report["block_size"] == 6
    assert report["cells"] == {"line": len(found.lines)}


def test_the_mast_of_the_demonstration():
    true = mast()
    found = recover(true.matrix, anchors=true.anchors)
    assert found.certified
    np.testing.assert_allclose(found.points, true.points, atol=1e-12)
    assert len(found.lines) == 8 * (4 + 4) + 9 * (4 + 1)
