"""What does not fit is said, in one sentence, and nothing that fits is lost."""

import networkx
import numpy as np
import pytest
import scipy.sparse as sp

from meshes import delaunay, largest_error, random_mesh, specimen
from unassemble import GeometryError, InputError, RecoveryError, recover


def half_ring(n=9, inner=1.0, outer=1.5):
    angle = np.linspace(0, np.pi, n)
    points = np.vstack([r * np.column_stack([np.cos(angle), np.sin(angle)]) for r in (inner, outer)])
    k = np.arange(n - 1)
    triangles = np.vstack([np.column_stack([k, k + n, k + n + 1]), np.column_stack([k, k + n + 1, k + 1])])
    return points, triangles[:, [0, 1, 2]]


@pytest.mark.parametrize("seed", range(8))
def test_ring_of_two_pieces_that_share_two_vertices(seed):
    points, triangles = half_ring()
    n = len(points)
    # The second half meets the first in the two outer corners only: its inner corners are pulled back.
    below = -points
    cells = np.vstack([triangles, triangles + n])
    both = np.vstack([points, below])
    cells[cells == n + 9], cells[cells == n + 17] = 17, 9
    both[[n + 0, n + 8]] += [[0, -0.2], [0, -0.2]]
    used, cells = np.unique(cells, return_inverse=True)
    known = specimen(both[used], cells.reshape(-1, 3), c=2.0, seed=seed)
    found = recover(known.matrix, scale=2.0)
    assert len(found.hinges) == 2
    assert found.certified, found.reason
    # Each piece is right; on which side of the line through the hinges the other lies is not in the matrix.
    for label in (0, 1):
        rows = np.flatnonzero(found.component == label)
        assert largest_error(found.points[rows], known.points[rows]) < 1e-12
    assert any("a mirror image of its own" in note for note in found.warnings)


def bow_tie(seed=0):
    points, triangles = delaunay(np.array([[0, 0], [1, 0.3], [0.9, 1.1], [0.2, 0.9]]))
    joined = np.vstack([points, -points[1:] * [1, 0.7]])
    other = np.where(triangles == 0, 0, triangles + 3)
    return specimen(joined, np.vstack([triangles, other]), seed=seed)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_anchors_on_pieces_that_meet_in_a_vertex(count):
    known = bow_tie()
    first = known.triangles[0]
    anchors = [(int(row), *known.points[row]) for row in first[:count]]
    found = recover(known.matrix, anchors=anchors, scale=1.0)
    assert len(found.hinges) == 1
    assert found.certified, found.reason
    for row, x, y in anchors:
        assert found.points[row] == pytest.approx([x, y], abs=1e-12)


@pytest.mark.parametrize(
    "bad",
    [networkx.complete_graph(5), networkx.complete_bipartite_graph(3, 3), networkx.complete_graph(4)],
    ids=["K5", "K33", "K4"],
)
def test_component_without_a_mesh_does_not_stop_the_others(bad):
    known = specimen(*random_mesh(100))
    n = len(known.points)
    found = recover(sp.block_diag([-networkx.to_scipy_sparse_array(bad).astype(float), known.matrix], format="csr"))
    k = len(bad)
    assert found.status == "uncertified"
    assert f"component of row 0 ({k} rows)" in found.reason
    assert found.node_status.tolist() == [1] * k + [0] * n
    assert np.isnan(found.points[:k]).all()
    assert largest_error(found.points[k:], known.points) < 1e-12


def test_piece_without_a_mesh_does_not_stop_the_others():
    known = specimen(*random_mesh(100))
    n = len(known.points)
    signs = known.matrix.copy()
    rng = np.random.default_rng(0)
    signs.data[:] = 0
    upper = sp.triu(known.matrix, 1).tocoo()
    value = rng.standard_normal(upper.nnz)
    bad = sp.coo_array((np.r_[value, value], (np.r_[upper.row, upper.col], np.r_[upper.col, upper.row])), shape=(n, n))
    with pytest.raises(GeometryError, match="piece of row 0"):
        recover(bad)
    found = recover(sp.block_diag([known.matrix, bad], format="csr"))
    determined = np.flatnonzero(found.node_status == 0)
    assert found.reason.startswith("1 part of the matrix has no mesh: in the piece of row 100")
    assert len(determined) == n
    assert largest_error(found.points[determined], known.points[determined]) < 1e-12
    assert np.isnan(found.points[n:]).all()


@pytest.mark.parametrize(
    "entries",
    [(1.0, 1.0, -5.0), (-1.0, -1.0, 1.0), (-1e300, -1.0, -1.0), (-1.0, 1e-300, 1e-300)],
)
def test_triangles_that_do_not_exist(entries):
    a, b, c = entries
    with pytest.raises(RecoveryError):
        recover(sp.coo_array(([a, b, c] * 2, ([0, 0, 1, 1, 2, 2], [1, 2, 2, 0, 0, 1])), shape=(3, 3)))


@pytest.mark.parametrize("scale", [1e300, 1e-300])
def test_impossible_scale(scale):
    with pytest.raises(GeometryError, match="scale"):
        recover(specimen(*random_mesh(60)).matrix, scale=scale)


def test_wrong_scales():
    matrix = specimen(*random_mesh(60)).matrix
    with pytest.raises(GeometryError, match="or the given scale"):
        recover(matrix, scale=-1.0)
    found = recover(matrix, scale=0.97)
    assert found.status == "uncertified"
    assert "leave out `scale`" in found.advice


def test_options_that_cannot_be_used_are_reported_or_refused():
    known = specimen(*random_mesh(100))
    n = len(known.points)
    with pytest.raises(InputError, match="same position"):
        recover(known.matrix, anchors=[(1, 1.0, 1.0), (2, 1.0, 1.0)])
    for wrong in ({"anchors": [(0, 1)]}, {"anchors": "abc"}, {"direction": (0.5, 1, 30.0)}):
        with pytest.raises(InputError, match="whole rows"):
            recover(known.matrix, **wrong)
    three = [(row, *known.points[row]) for row in (0, 40, 80)]
    assert any("`handed` was not used" in w for w in recover(known.matrix, anchors=three, handed="left").warnings)
    alone = sp.block_diag([known.matrix, sp.eye_array(1)], format="csr")
    assert any("not used" in w for w in recover(alone, anchors=[(n, 0.0, 0.0)]).warnings)
    in_line = [(1, 0.0, 0.0), (2, 1.0, 0.0), (3, 5.0, 0.0), (4, -3.0, 0.0)]
    assert any("do not fit" in w for w in recover(known.matrix, anchors=in_line).warnings)


@pytest.mark.parametrize("size", [1e200, 1e-200])
def test_tensors_of_any_size(size):
    known = specimen(*random_mesh(100))
    found = recover(known.matrix, tensor=(size, 0.0, size), direction=(0, 1, 30.0), handed="left")
    assert found.certified
    assert found.scale == pytest.approx(1 / size)


def test_noise_test_says_when_there_is_nothing_to_test():
    known = specimen(np.array([[0, 0], [1, 0], [0.3, 0.8]]), np.array([[0, 1, 2]]))
    found = recover(known.matrix, noise=0.1)
    assert found.status == "uncertified"
    assert "no entry to spare" in found.reason


def test_noise_is_tested():
    known = specimen(*random_mesh(400))
    upper = sp.triu(known.matrix, 1).tocoo()
    sigma, rng = 1e-6, np.random.default_rng(0)
    value = upper.data + sigma * rng.standard_normal(upper.nnz)
    noisy = sp.coo_array((np.r_[value, value], (np.r_[upper.row, upper.col], np.r_[upper.col, upper.row])))
    assert recover(noisy, noise=sigma).certified
    assert recover(noisy, noise=sigma / 3).status == "uncertified"
    assert recover(noisy).status == "uncertified"
    deviations = recover(noisy, noise=sigma, standard_deviations=True).standard_deviations
    assert np.isfinite(deviations).all()
    assert (deviations > 0).all()


def test_eliminated_boundary_is_seen():
    """The interior of a Dirichlet problem: entries next to the boundary contain triangles that are gone."""
    points, triangles = random_mesh(300, seed=1, holes=False)
    known = specimen(points, triangles, c=2.0)
    found = recover(known.matrix)
    inside = np.setdiff1d(np.arange(len(points)), found.boundary)
    taken = recover(known.matrix[inside][:, inside])
    assert taken.certified
    assert "are determined" in taken.reason


def test_the_laplacian_of_a_graph_is_named():
    graph = networkx.convert_node_labels_to_integers(networkx.triangular_lattice_graph(5, 9))
    order = np.random.default_rng(0).permutation(len(graph)).tolist()
    found = recover(networkx.laplacian_matrix(graph, nodelist=order).astype(float))
    assert not found.certified
    assert "the Laplacian of a graph" in found.reason


def test_a_wrong_entry_moves_no_determined_point():
    known = specimen(*random_mesh(220, seed=1))
    spoilt = known.matrix.tolil()
    i, j = np.argwhere(np.triu(known.matrix.toarray(), 1))[100]
    spoilt[i, j] = spoilt[j, i] = 1.01 * spoilt[i, j]
    found = recover(spoilt)
    right = found.node_status == 0
    assert not found.certified or largest_error(found.points[right], known.points[right]) < 1e-10


@pytest.mark.parametrize("scale", [-1e308, 1e200, 1e40, 1e-40, 5e-324])
def test_a_scale_out_of_all_proportion(scale):
    with pytest.raises(GeometryError, match="proportion"):
        recover(specimen(*random_mesh(40)).matrix, scale=scale)
