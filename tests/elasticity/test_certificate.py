"""The certificate of bodies: the matrix re-assembled on the body as it is written, by elements of its own."""

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import ELEMENTS, box, heterogeneous, on_plane, permuted_nodes, stiffness

from unassemble import recover
from unassemble.certificate import certify_body, certify_positions
from unassemble.elasticity import against_body

COUNTS = {"tri": (5, 6), "qua": (5, 6), "tet": (3, 4, 3), "hex": (3, 4, 3)}


def body(kind, **material):
    return permuted_nodes(stiffness(kind, box(kind, COUNTS[kind[:3]], perturb=0.2), **material), seed=1)


def written(matrix, digits):
    """Entries with so many digits."""
    matrix = sp.csr_array(matrix)
    data = np.array([float(f"{x:.{digits - 1}e}") for x in matrix.data])
    return sp.csr_array((data, matrix.indices, matrix.indptr), shape=matrix.shape)


def on_the_result(found, matrix, **changed):
    """The certificate of a result with some of its arrays changed."""
    arrays = {"points": found.points, "lame": found.lame} | changed
    matrix, rows = sp.csr_array(matrix), (found.node_of_row, found.direction_of_row)
    return certify_body(matrix, *rows, arrays["points"], found.cells, arrays["lame"])


@pytest.mark.parametrize("kind", ELEMENTS)
def test_a_body_at_its_anchors_gives_all_rows_back(kind):
    """Points in the units and in the place of the anchors, and coefficients in these units."""
    case = body(kind, lam=1.5)
    points = 3.7 * case.points + 11.0
    ends = (0, len(points) - 1)
    anchors = [(case.dim * node, *points[node]) for node in ends]
    found = recover(case.matrix, anchors=anchors)
    assert found.certified, found.reason
    certificate = on_the_result(found, case.matrix)
    assert max(certificate.backward_error, found.backward_error) < 1e-11
    assert certificate.compared.all()
    assert not len(certificate.unexplained)


@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1", "tet-p1", "hex-q1", "tri-p2"])
def test_what_is_changed_shows_in_the_rows_that_it_touches(kind):
    case = body(kind, lam=1.5)
    found = recover(case.matrix)
    moved = found.points.copy()
    moved[7] += 1e-6
    certificate = on_the_result(found, case.matrix, points=moved)
    assert certificate.backward_error > 1e-8
    assert (found.node_of_row[certificate.worst(1)[0]] == 7).any() or len(certificate.unexplained)
    weaker = found.lame.copy()
    weaker[3] *= 1 - 1e-6
    assert on_the_result(found, case.matrix, lame=weaker).backward_error > 1e-8
    given = sp.lil_array(case.matrix)
    entries = np.abs(case.matrix[[2]].toarray().ravel())
    entries[case.dim * (2 // case.dim) :][: case.dim] = 0  # between the node and itself
    row, column = 2, int(entries.argmax())
    given[row, column] *= 1 + 1e-6
    given[column, row] = given[row, column]
    certificate = on_the_result(found, given)
    assert not certificate.compared[[row, column]].any()  # no row of theirs adds up to zero any more


@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1", "tet-p1", "hex-q1"])
def test_a_weak_cell_that_is_left_out_shows(kind):
    """Each entry is held against its own rows, not against the largest of the matrix."""
    mesh = box(kind, COUNTS[kind[:3]], perturb=0.2)
    modulus = np.where(mesh.p[:, mesh.t].mean(axis=1)[0] > 0.6, 1e-6, 1.0)[:, None]
    case = permuted_nodes(stiffness(kind, mesh, lam=1.5 * modulus, mu=modulus), seed=1)
    found = recover(case.matrix)
    assert found.certified
    (name, cells), *_ = found.cells.items()
    kept = found.lame[:, 1] > 1e-3 * found.lame[:, 1].max()
    assert 0 < kept.sum() < len(cells)
    rows = found.node_of_row, found.direction_of_row
    certificate = certify_body(case.matrix, *rows, found.points, {name: cells[kept]}, found.lame[kept])
    assert certificate.backward_error > 1e-2
    assert len(certificate.unexplained)


@pytest.mark.parametrize("kind", ["quad-q1", "tri-p2", "tet-p2", "hex-q1"])
def test_positions_alone_are_certified_where_material_varies_within_cells(kind):
    case = body(kind, lam=heterogeneous, mu=lambda x: 1 + x[0] * x[1], within=True)
    found = recover(case.matrix)
    assert found.certified
    rows = found.node_of_row, found.direction_of_row
    certificate = certify_positions(case.matrix, *rows, found.points)
    assert max(certificate.backward_error, found.backward_error) < 1e-11
    assert certificate.compared.all()
    moved = found.points.copy()
    moved[5] += 1e-6
    assert certify_positions(case.matrix, *rows, moved).backward_error > 1e-8


def test_rows_next_to_a_clamp_are_not_compared():
    case = body("quad-q1", lam=1.5)
    gone = np.repeat(on_plane(case, 0), 2)
    matrix = case.matrix[~gone][:, ~gone]
    found = recover(matrix)
    assert found.certified
    certificate = on_the_result(found, matrix)
    assert 0 < certificate.compared.sum() < len(certificate.compared)
    beside = np.abs(case.matrix[~gone][:, gone]).sum(axis=1) > 0
    assert not certificate.compared[beside].any()


def test_what_supports_leave_of_elements_is_a_stiffness_and_what_a_wrong_entry_leaves_is_none():
    """Elements that lost a node leave a positive semidefinite matrix; a changed entry next to them does not."""
    case = body("tri-p1", lam=1.5)
    gone = np.repeat(on_plane(case, 0), 2)
    matrix = sp.csr_array(case.matrix[~gone][:, ~gone])
    beside = np.flatnonzero(np.abs(case.matrix[~gone][:, gone]).sum(axis=1) > 0)
    found = recover(matrix)
    assert found.certified
    certificate = on_the_result(found, matrix)
    silent = certificate.silent(1e-9)
    assert len(silent)
    assert set(silent) <= set(beside)
    assert certificate.could_be_elements(1e-8)
    assert any("may be missing" in warning for warning in found.warnings)
    entry = matrix.tocoo()
    near = np.isin(entry.row, beside) & np.isin(entry.col, beside) & (np.abs(entry.data) > 0.1)
    near &= found.node_of_row[entry.row] < found.node_of_row[entry.col]
    i, j = int(entry.row[near][0]), int(entry.col[near][0])
    changed = matrix.tolil()
    changed[i, j] = changed[j, i] = 20 * matrix[i, j]
    assert not on_the_result(found, sp.csr_array(changed)).could_be_elements(1e-8)
    assert not recover(sp.csr_array(changed)).certified


@pytest.mark.parametrize("digits", [None, 12, 8])
def test_few_digits_hide_no_wrong_entry(digits):
    """What is an objection to exact entries stays one where they are written with few digits."""
    case = body("quad-q1", lam=1.5)
    right = case.matrix if digits is None else written(case.matrix, digits)
    found = recover(right)
    assert found.certified
    assert not any("may be missing" in warning for warning in found.warnings)
    node = found.node_of_row
    entry = sp.csr_array(case.matrix).tocoo()
    near = (node[entry.row] < node[entry.col]) & (np.abs(entry.data) > 0.1)
    for i, j in ((int(entry.row[near][0]), int(entry.col[near][0])), (0, len(node) - 1)):
        wrong = sp.lil_array(case.matrix)
        wrong[i, j] = wrong[j, i] = wrong[i, j] + 0.3
        changed = sp.csr_array(wrong)
        refused = recover(changed if digits is None else written(changed, digits))
        assert not refused.certified
        assert set(refused.worst_entries[0]) == {i, j}
        assert refused.backward_error > 0.05
        assert f"rows {min(i, j)} and {max(i, j)} that no other element" in refused.reason


@pytest.mark.parametrize("digits", [None, 12])
@pytest.mark.parametrize("penalty", [1e4, 1e12])
@pytest.mark.parametrize("directions", [(0,), (0, 1)])
def test_penalties_hide_no_wrong_entry_beside_them(directions, penalty, digits):
    """No node is gone there, so that all entries of these rows are compared, but for the diagonals."""
    case = body("quad-q1", lam=1.5)
    held = np.flatnonzero(on_plane(case, 0))
    matrix = sp.lil_array(case.matrix)
    for row in (2 * held[:, None] + directions).ravel():
        matrix[row, row] += penalty
    right = sp.csr_array(matrix)
    found = recover(right if digits is None else written(right, digits))
    assert found.certified, found.reason
    assert not any("may be missing" in warning for warning in found.warnings)
    first, other = 2 * held[0], 2 * held[1:]
    coupled = np.array([right[first, row] != 0 for row in other])
    for row, value in ((other[coupled][0], -3 * right[first, other[coupled][0]]), (other[~coupled][0], 0.3)):
        wrong = right.tolil()
        wrong[first, row] = wrong[row, first] = value
        changed = sp.csr_array(wrong)
        assert not recover(changed if digits is None else written(changed, digits)).certified


def test_elements_all_of_whose_nodes_have_penalties_may_be_missing():
    """No row without a penalty shows them, which a warning says."""
    case = body("tet-p1", lam=1.5)
    flat = case.points[:, :2]
    held = (np.isclose(flat, flat.min(axis=0)) | np.isclose(flat, flat.max(axis=0))).any(axis=1)
    found = recover(sp.csr_array(case.matrix + sp.diags_array(1e8 * np.repeat(held, 3))))
    assert found.certified, found.reason
    whole = recover(case.matrix)
    assert found.n_cells == whole.n_cells or any("may be missing" in warning for warning in found.warnings)


def test_a_body_of_which_nothing_can_be_compared_is_not_certified():
    case = body("quad-q1", lam=1.5)
    found = recover(case.matrix)
    nowhere = np.full_like(found.points, np.nan)
    rows = found.node_of_row, found.direction_of_row
    allowed = np.full(len(rows[0]), 1e-9)
    unnamed = rows[0], np.full_like(rows[1], -1)
    matrix = sp.csr_array(case.matrix)
    for certificate in (
        certify_positions(matrix, *rows, nowhere),
        certify_body(matrix, *unnamed, found.points, found.cells, found.lame),
    ):
        assert np.isnan(certificate.backward_error)
        foreign, _ = certificate.of_no_element(allowed)
        assert len(list(against_body(certificate, foreign, allowed))) == 1


def test_worst_entries_come_once_and_are_none_for_identities():
    case = body("quad-q1", lam=1.5)
    found = recover(case.matrix)
    moved = found.points.copy()
    moved[7] += 1e-3
    pairs, misfits = on_the_result(found, case.matrix, points=moved).worst(20)
    assert len(pairs) == 20
    assert len(np.unique(np.sort(pairs, axis=1), axis=0)) == 20
    assert (np.diff(misfits) <= 0).all()
    rows = found.node_of_row, found.direction_of_row
    certificate = certify_positions(sp.csr_array(case.matrix), *rows, moved)
    assert certificate.backward_error > 1e-6
    assert not len(certificate.worst(20)[0])


def test_a_clamped_body_says_how_many_rows_are_given_back():
    case = body("quad-q1", lam=1.5)
    gone = np.repeat(on_plane(case, 0), 2)
    matrix = sp.csr_array(case.matrix[~gone][:, ~gone])
    beside = int(np.count_nonzero(np.abs(case.matrix[~gone][:, gone]).sum(axis=1)))
    found = recover(matrix)
    assert found.certified
    assert f"give back {len(matrix.indptr) - 1 - beside} of the {len(matrix.indptr) - 1} rows" in found.reason
    assert any(f"{beside} rows are not compared" in warning for warning in found.warnings)


@pytest.mark.parametrize(("kind", "digits"), [("tri-p1", 8), ("tri-p1", 12), ("tet-p1", 8)])
def test_elements_that_few_digits_hide_are_spoken_of(kind, digits):
    """A weak element looks like a hole there."""
    mesh = box(kind, (8, 8) if kind == "tri-p1" else (4, 4, 4), perturb=0.2)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    near = np.hypot(*(middle[:2] - np.ptp(mesh.p, axis=1)[:2, None] / 2)) < 0.15
    assert near.any()
    for contrast, hidden in ((1.0, False), (1e-3, False), (1e-9, True)):
        modulus = np.where(near, contrast, 1.0)[:, None]
        case = permuted_nodes(stiffness(kind, mesh, lam=1.5 * modulus, mu=modulus), seed=1)
        found = recover(written(case.matrix, digits))
        assert found.certified
        assert any("rounding of the entries hides" in warning for warning in found.warnings) == hidden
        assert found.n_cells == mesh.nelements or hidden
