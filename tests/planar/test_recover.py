"""Round trips through the whole pipeline."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings, strategies as st

from meshes import delaunay, largest_error, random_mesh, specimen, triangle_set
from unassemble import GeometryError, InputError, NotPlanarError, recover
from unassemble.linalg import pardiso


@pytest.mark.fallback
@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    n=st.integers(9, 900),
    seed=st.integers(0, 10_000),
    exponent=st.floats(-3, 3),
    sign=st.sampled_from([-1, 1]),
    diagonal=st.booleans(),
    refine=st.booleans(),
)
def test_round_trip(n, seed, exponent, sign, diagonal, refine):
    c = sign * 10**exponent
    known = specimen(*random_mesh(n, seed), c=c, diagonal=diagonal, seed=seed)
    found = recover(known.matrix, refine=refine)
    assert found.status == "certified", found.reason
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
    assert largest_error(found.points, known.points) <= (1e-12 if refine else 1e-8)
    assert found.scale == pytest.approx(c, rel=1e-11)


@pytest.mark.fallback
@pytest.mark.parametrize("c", [1.0, -1.0, 1e-3, -250.0, 1e60, 1e-60])
def test_scale_is_found_with_its_sign(c):
    known = specimen(*random_mesh(300), c=c, diagonal=abs(c) < 1e50)
    found = recover(known.matrix)
    assert found.certified
    assert found.scale == pytest.approx(c, rel=1e-12)


@pytest.mark.parametrize("c", [1.0, -41.0])
def test_without_polish_errors_stay_at_the_level_of_edges(c):
    known = specimen(*random_mesh(20_000, seed=4), c=c, seed=2)
    found = recover(known.matrix, refine=False)
    assert found.backward_error < 5e-12
    assert largest_error(found.points, known.points) < 1e-11


def test_known_scale_is_kept():
    known = specimen(*random_mesh(300), c=4.0)
    assert recover(known.matrix, scale=4.0).certified
    wrong = recover(known.matrix, scale=4.1)
    assert wrong.status == "uncertified"
    assert wrong.scale == pytest.approx(4.1)


def test_cells_are_counter_clockwise_and_boundaries_have_the_mesh_on_the_left():
    known = specimen(*random_mesh(500))
    found = recover(known.matrix)
    a, b, c = (found.points[found.triangles[:, k]] @ [1, 1j] for k in range(3))
    assert (np.imag(np.conj(b - a) * (c - a)) > 0).all()
    assert found.n_holes == 2
    half_edges = {tuple(pair) for pair in found.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).tolist()}
    assert all(tuple(pair) in half_edges for pair in found.boundary.tolist())
    for start, stop in zip(found.boundary_offsets[:-1], found.boundary_offsets[1:], strict=True):
        loop = found.boundary[start:stop]
        assert (loop[:, 1] == np.roll(loop[:, 0], -1)).all()


def test_gauge_without_anchors():
    known = specimen(*random_mesh(400, seed=3))
    points = recover(known.matrix).points
    edges = np.unique(np.sort(known.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    assert points.mean(axis=0) == pytest.approx([0, 0], abs=1e-12)
    assert np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1).mean() == pytest.approx(1)
    moments = points.T @ points
    assert moments[0, 1] == pytest.approx(0, abs=1e-9 * moments[0, 0])
    assert moments[0, 0] > moments[1, 1]
    assert ((points**3).sum(axis=0) > 0).all()


def test_row_order_carries_no_information():
    points, triangles = random_mesh(400, seed=4)
    meshes = []
    for seed in (0, 1, 2):
        known = specimen(points, triangles, c=-7.0, seed=seed)
        found = recover(known.matrix)
        order = np.lexsort(known.points.T)
        meshes.append(found.points[order])
    assert np.abs(meshes[1] - meshes[0]).max() < 1e-11
    assert np.abs(meshes[2] - meshes[0]).max() < 1e-11


def test_same_answer_on_every_run():
    matrix = specimen(*random_mesh(3000), c=2.0).matrix
    first, second = recover(matrix), recover(matrix)
    assert np.array_equal(first.points, second.points)


@pytest.mark.skipif(not pardiso.available(), reason="MKL is not installed")
@pytest.mark.parametrize("refine", [True, False])
def test_both_solvers_give_the_same_answer(refine, monkeypatch):
    matrix = specimen(*random_mesh(1500, seed=2), c=-6.0, diagonal=True).matrix
    points = []
    for solver in ("pardiso", "superlu"):
        monkeypatch.setenv("UNASSEMBLE_SOLVER", solver)
        points.append(recover(matrix, refine=refine).points)
    assert np.abs(points[1] - points[0]).max() < (1e-11 if refine else 1e-7)


def test_anchors_put_the_mesh_where_it_was():
    known = specimen(*random_mesh(300), c=3.0)
    three = [(row, *known.points[row]) for row in (0, 100, 200)]
    assert np.abs(recover(known.matrix, anchors=three).points - known.points).max() < 1e-12
    two = recover(known.matrix, anchors=three[:2])
    for row, x, y in three[:2]:
        assert two.points[row] == pytest.approx([x, y], abs=1e-12)
    one = recover(known.matrix, anchors=three[:1])
    assert one.points[three[0][0]] == pytest.approx(three[0][1:], abs=1e-12)


def test_anchors_that_do_not_fit_are_reported():
    known = specimen(*random_mesh(300))
    anchors = [(0, *known.points[0]), (100, *known.points[100]), (200, *(known.points[200] + 0.1)), (5, 0.0, 0.0)]
    assert any("anchors do not fit" in warning for warning in recover(known.matrix, anchors=anchors).warnings)


@pytest.mark.parametrize("tensor", [(1.0, 0.0, 1.0), (9.0, 0.0, 1.0), (2.0, -0.7, 0.6)])
def test_constant_tensor_is_undone(tensor):
    known = specimen(*random_mesh(300), c=-5.0, tensor=tensor)
    anchors = [(row, *known.points[row]) for row in (0, 100, 200)]
    found = recover(known.matrix, tensor=tensor, anchors=anchors)
    assert found.certified
    assert found.scale == pytest.approx(-5.0)
    assert np.abs(found.points - known.points).max() < 1e-12


@pytest.mark.parametrize("turn", [0.0, 1.0, 4.0])
def test_direction_and_handedness_replace_anchors(turn):
    tensor = (4.0, 0.5, 1.0)
    points, triangles = random_mesh(300)
    points = points @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    known = specimen(points, triangles, c=2.0, tensor=tensor)
    a, b = 0, 150
    line, offset = known.points[b] - known.points[a], known.points.mean(axis=0) - known.points[a]
    handed = "left" if line[0] * offset[1] - line[1] * offset[0] > 0 else "right"
    degrees = float(np.rad2deg(np.arctan2(line[1], line[0])))
    found = recover(known.matrix, tensor=tensor, direction=(a, b, degrees), handed=handed)
    size = np.linalg.norm(line) / np.linalg.norm(found.points[b] - found.points[a])
    shift = known.points.mean(axis=0) - size * found.points.mean(axis=0)
    assert np.abs(size * found.points + shift - known.points).max() < 1e-12
    assert found.points.mean(axis=0) == pytest.approx([0, 0], abs=1e-12)


def test_what_a_tensor_needs_is_said():
    known = specimen(*random_mesh(100), tensor=(4.0, 0.0, 1.0))
    with pytest.raises(InputError, match="three `anchors`"):
        recover(known.matrix, tensor=(4.0, 0.0, 1.0))
    with pytest.raises(InputError, match="handed"):
        recover(known.matrix, tensor=(4.0, 0.0, 1.0), direction=(0, 1, 30.0))
    with pytest.raises(InputError, match="positive definite"):
        recover(known.matrix, tensor=(1.0, 2.0, 1.0), direction=(0, 1, 30.0), handed="left")


def test_disconnected_pieces_have_scales_and_frames_of_their_own():
    one, two = specimen(*random_mesh(200), c=2.0), specimen(*random_mesh(90, seed=1), c=-0.1)
    matrix = sp.block_diag([one.matrix, two.matrix], format="csr")
    found = recover(matrix)
    assert found.certified
    assert found.scale == pytest.approx([2.0, -0.1])
    n = len(one.points)
    assert largest_error(found.points[:n], one.points) < 1e-12
    assert largest_error(found.points[n:], two.points) < 1e-12
    assert (found.component == np.repeat([0, 1], [n, len(two.points)])).all()


def test_pieces_that_share_a_vertex_meet_there():
    points, triangles = random_mesh(120, holes=False)
    last, first = int(np.argmax(points[:, 0])), int(np.argmin(points[:, 0]))
    joined = np.vstack([points, points + points[last] - points[first]])
    cells = np.vstack([triangles, triangles + len(points)])
    cells[cells == len(points) + first] = last
    used, cells = np.unique(cells, return_inverse=True)
    joined = joined[used]
    known = specimen(joined, cells.reshape(-1, 3))
    found = recover(known.matrix)
    assert found.certified
    assert found.n_components == 2
    assert len(found.hinges) == 1
    assert known.points[found.hinges[0]] == pytest.approx(joined[last] - joined.mean(axis=0))
    for label in (0, 1):
        rows = np.unique(found.triangles[(found.component[found.triangles] == label).any(axis=1)])
        rows = rows[(found.component[rows] == label) | (rows == found.hinges[0])]
        assert largest_error(found.points[rows], known.points[rows]) < 1e-12


def test_isolated_rows_have_no_position():
    known = specimen(*random_mesh(100))
    n = len(known.points)
    matrix = sp.csr_array(sp.block_diag([known.matrix, sp.csr_array(np.eye(2))]))
    found = recover(matrix)
    assert found.certified
    assert np.isnan(found.points[n:]).all()
    assert found.node_status.tolist() == [0] * n + [1, 1]
    assert (found.component[n:] == -1).all()
    assert any("no position" in warning for warning in found.warnings)


@pytest.mark.slow
def test_changed_entry_is_found_and_named():
    known = specimen(*random_mesh(400))
    matrix = known.matrix.copy()
    i, j = known.triangles[7, :2]
    matrix[i, j] = matrix[j, i] = matrix[i, j] * 1.01
    found = recover(matrix)
    assert found.status == "uncertified"
    near = set(known.triangles[(known.triangles == i).any(axis=1) | (known.triangles == j).any(axis=1)].ravel())
    assert set(found.worst_entries[0]) <= near


def test_entry_across_the_mesh_is_not_planar():
    known = specimen(*random_mesh(400, holes=False))
    boundary = int(np.argmin(known.points.sum(axis=1)))
    middle = int(np.argmin(np.abs(known.points - known.points.mean(axis=0)).sum(axis=1)))
    far = [boundary, middle]
    matrix = known.matrix.tolil()
    matrix[far[0], far[1]] = matrix[far[1], far[0]] = -0.3
    with pytest.raises(NotPlanarError, match="not planar"):
        recover(matrix.tocsr())


def test_curved_surface_is_not_certified():
    points, triangles = random_mesh(300, holes=False)
    x, y = points.T
    height = 0.4 * np.cos(3 * x) * np.cos(2 * y)
    surface = np.column_stack([points, height])
    n = len(points)
    rows, columns, values = [], [], []
    for k in range(3):
        c, a, b = triangles[:, k], triangles[:, (k + 1) % 3], triangles[:, (k + 2) % 3]
        u, w = surface[a] - surface[c], surface[b] - surface[c]
        cotangent = (u * w).sum(axis=1) / np.linalg.norm(np.cross(u, w), axis=1) / 2
        rows, columns, values = rows + [a, b], columns + [b, a], values + [-cotangent, -cotangent]
    matrix = sp.coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(n, n))
    found = recover(matrix)
    assert found.status == "uncertified"
    assert found.backward_error > 1e-6


def test_graph_without_triangles():
    leaves = list(range(1, 10))  # four right angles at the centre have room for eight
    star = sp.coo_array((-np.ones(18), ([0] * 9 + leaves, leaves + [0] * 9)), shape=(10, 10))
    with pytest.raises(GeometryError, match="none has its entries"):
        recover(star)


@pytest.mark.parametrize(
    "points",
    [
        [[0, 0], [1, 0], [0.3, 0.8]],
        [[0, 0], [1, 0], [0.3, 0.8], [1.2, 1.0]],
        [[0, 0], [1, 0], [1.5, 0.9], [0.6, 1.6], [-0.4, 0.8], [0.5, 0.7]],
    ],
    ids=["one triangle", "two", "a wheel"],
)
def test_smallest_meshes(points):
    known = specimen(*delaunay(np.array(points, dtype=float)), c=-3.0)
    found = recover(known.matrix, scale=-3.0)
    assert found.certified
    assert largest_error(found.points, known.points) < 1e-13


def test_uniform_grid_with_stored_zeros():
    k = 30
    grid = np.stack(np.meshgrid(np.arange(k), np.arange(k)), axis=-1).reshape(-1, 2) / k
    cell = (np.arange(k - 1)[:, None] * k + np.arange(k - 1)).ravel()
    triangles = np.vstack(
        [np.column_stack([cell, cell + 1, cell + k + 1]), np.column_stack([cell, cell + k + 1, cell + k])]
    )
    known = specimen(grid, triangles, c=12.0)
    found = recover(known.matrix)
    assert found.certified
    assert largest_error(found.points, known.points) < 1e-12
    assert any("arbitrary" in warning for warning in found.warnings)  # the square's moments tie


def test_threads_and_progress():
    stages = []
    found = recover(specimen(*random_mesh(100)).matrix, threads=1, progress=stages.append)
    assert found.certified
    assert stages == list(found.timings) == ["read", "check", "topology", "conformal", "polish", "place", "certify"]
    with pytest.raises(InputError, match="threads"):
        recover(specimen(*random_mesh(100)).matrix, threads=0)


@pytest.mark.parametrize(
    "options",
    [
        {"operator": "helmholtz"},
        {"method": "magic"},
        {"scale": 0.0},
        {"scale": np.nan},
        {"noise": -1.0},
        {"anchors": [(0, 0.0, 0.0), (0, 1.0, 0.0)]},
        {"anchors": [(99999, 0.0, 0.0)]},
        {"anchors": [(0, np.inf, 0.0)]},
        {"direction": (1, 1, 0.0)},
        {"handed": "left"},
        {"direction": (0, 1, 0.0), "handed": "up"},
        {"direction": (0, 1, 0.0), "anchors": [(0, 0.0, 0.0), (1, 1.0, 0.0)]},
    ],
    ids=str,
)
def test_options_that_make_no_sense(options):
    with pytest.raises(InputError):
        recover(specimen(*random_mesh(50)).matrix, **options)


@pytest.mark.parametrize("noise", [None, 1e-9])
def test_anchors_far_from_the_origin(noise):
    """Where coordinates lose their digits it is they that are at fault, not the matrix."""
    known = specimen(*random_mesh(200, seed=3))
    for far, certified in ((0.0, True), (1e4, True), (1e9, False)):
        points = known.points + [far, -far]
        found = recover(known.matrix, anchors=[(row, *points[row]) for row in (0, 80, 160)], noise=noise)
        assert found.certified == certified, found.reason
        assert np.abs(found.points - points).max() < 4e-16 * far + 1e-7
        if not certified:
            assert "too few digits" in found.reason
            assert "the entry" not in found.reason
            assert not len(found.worst_entries)


def test_far_anchors_of_one_piece_leave_the_others_alone():
    one, other = specimen(*random_mesh(120, seed=4)), specimen(*random_mesh(90, seed=5))
    both = sp.block_diag([one.matrix, other.matrix], format="csr")
    free = recover(both)
    found = recover(both, anchors=[(0, 1e3, 0.0), (7, 1e3 + 1, 0.0)])
    assert found.certified
    rest = slice(one.matrix.shape[0], None)
    assert np.abs(found.points[rest] - free.points[rest]).max() < 1e-14
