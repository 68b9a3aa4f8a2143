"""Other meshes with the same matrix: each that is named is one, and those that are known are named."""

import networkx
import numpy as np
import pytest
import scipy.sparse as sp

from families import member
from meshes import largest_error, random_mesh, specimen, triangle_set
from named_meshes import cells_of, check_alternatives, explains
from unassemble import recover
from vanishing import forgotten, holes, polar, refined, squares, without_zeros


def weighted(graph, seed=0):
    rng = np.random.default_rng(seed)
    n = len(graph)
    i, j = np.array(graph.edges).T
    row = rng.permutation(n)
    w = rng.uniform(0.5, 2, len(i))
    return sp.coo_array((np.r_[-w, -w], (row[np.r_[i, j]], row[np.r_[j, i]])), shape=(n, n)).tocsr()


LOOSE = {
    "path": networkx.path_graph(4),
    "longer path": networkx.path_graph(9),
    "star of three": networkx.star_graph(3),
    "star of four": networkx.star_graph(4),
    "triangle and an edge": networkx.Graph([(0, 1), (1, 2), (2, 0), (2, 3)]),
    "triangle and two edges": networkx.Graph([(0, 1), (1, 2), (2, 0), (2, 3), (2, 4)]),
    "triangle and a path": networkx.Graph([(0, 1), (1, 2), (2, 0), (2, 3), (3, 4)]),
    "square and an edge": networkx.Graph([(0, 1), (1, 2), (2, 3), (3, 0), (0, 4)]),
    "two triangles and an edge": networkx.Graph([(0, 1), (1, 2), (2, 0), (1, 3), (2, 3), (2, 4)]),
}


@pytest.mark.parametrize("name", LOOSE)
def test_all_vertices_on_the_boundary_and_a_right_angle(name):
    """As many unknowns as entries: other cells fit with another factor, and only a known one decides."""
    matrix = weighted(LOOSE[name], seed=len(name))
    found = check_alternatives(matrix)
    assert found.alternatives
    assert "in place of" in found.reason
    assert "factor c" in found.reason
    assert recover(matrix, scale=found.scale[0]).certified


@pytest.mark.parametrize("name", ["triangle", "two triangles", "square", "fan"])
def test_without_right_angles_there_is_one_reading(name):
    graphs = {
        "triangle": networkx.cycle_graph(3),
        "two triangles": networkx.Graph([(0, 1), (1, 2), (2, 0), (1, 3), (2, 3)]),
        "square": networkx.cycle_graph(4),
        "fan": networkx.Graph([(0, k) for k in range(1, 6)] + [(k, k + 1) for k in range(1, 5)]),
    }
    assert check_alternatives(weighted(graphs[name])).certified


def test_right_angle_on_a_mesh_with_vertices_inside():
    """What surplus of entries there is tells on which side a lone edge is joined to the rest."""
    points, triangles = random_mesh(40, seed=1)
    edges, count = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0,
                             return_counts=True)  # fmt: skip
    a, b = edges[count == 1][0]
    inside = points[np.setdiff1d(triangles[(triangles == a).any(1) & (triangles == b).any(1)][0], [a, b])[0]]
    side = points[b] - points[a]
    normal = np.array([-side[1], side[0]])
    normal *= -np.sign(normal @ (inside - points[a]))
    points = np.vstack([points, points[b] + 0.7 * normal])
    known = specimen(points, np.vstack([triangles, [a, b, len(points) - 1]]))
    found = check_alternatives(without_zeros(known.matrix))
    assert found.certified
    assert triangle_set(found.triangles) == triangle_set(known.triangles)


SAME = {
    "one row of crossed squares": squares(holes(4, 1), crossed=True),
    "a row between the outside and a hole": squares(holes(8, 8, (5, 1, 2, 2)), crossed=True),
    "an arch": squares(holes(5, 4, (2, 1, 1, 3)), crossed=True),
}


@pytest.mark.parametrize("name", SAME)
def test_parts_that_can_be_turned_over(name):
    known = forgotten(specimen(*SAME[name], c=-3.0, seed=2))
    found = check_alternatives(known.matrix)
    assert found.alternatives
    assert all(other.same_scale for other in found.alternatives)
    assert not recover(known.matrix, scale=-3.0).certified  # a known factor does not decide here


def touching(kind):
    """Cells about the origin and, on opposite sides of it, what may as well be cells in the gaps."""
    points = np.array([(0, 0), (1.3, 0), (0, 0.8), (-1.3, 0), (0, -0.8), (1.3, 0.8), (-1.3, -0.8)])
    if kind == "triangles":
        points[5:] += [(0.1, 0.3), (-0.2, 0.1)]
    own = np.array([(0, 1, 2), (1, 5, 2), (0, 3, 4), (3, 6, 4)])
    other = np.array([(1, 5, 2), (3, 6, 4), (0, 2, 3), (0, 4, 1)])
    return points, own, other


@pytest.mark.parametrize("c", [None, 2.0])
@pytest.mark.parametrize("kind", ["rectangles", "triangles"])
def test_right_angles_that_touch_may_lie_in_the_gaps_between_them(kind, c):
    points, own, other = touching(kind)
    known, same = (forgotten(specimen(points, cells, c=2.0, seed=5)) for cells in (own, other))
    assert abs(known.matrix - same.matrix).max() < 1e-14
    found = recover(known.matrix, scale=c)
    assert not found.certified
    (alternative,) = found.alternatives
    assert alternative.same_scale
    added = {tuple(sorted(cell)) for cell in alternative.other_cells}
    assert added >= triangle_set(same.triangles) - triangle_set(found.triangles)


def noisy(matrix, sigma):
    upper = sp.triu(matrix, 1).tocoo()
    value = upper.data + sigma * np.random.default_rng(0).standard_normal(upper.nnz)
    ends = np.r_[upper.row, upper.col], np.r_[upper.col, upper.row]
    return sp.coo_array((np.r_[value, value], ends), shape=matrix.shape)


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("sigma", [3e-10, 1e-6, 1e-3])
def test_noise_leaves_right_angles_that_touch_in_doubt(sigma, told):
    """Corners of cells that rectangles become are right angles to within the noise only."""
    mask = np.ones((5, 4), bool)
    mask[[2, 1], [1, 2]] = False  # two holes that meet in a vertex
    known = forgotten(specimen(*squares(mask, width=0.7), c=2.0, seed=5))
    assert recover(known.matrix, scale=2.0).alternatives
    found = recover(noisy(known.matrix, sigma), noise=sigma if told else None)
    assert found.status == ("ambiguous" if found.alternatives else "uncertified")
    if told or sigma < 1e-9:
        assert found.alternatives


def test_rectangles_of_other_shapes_that_touch_are_certified():
    points, own, _ = touching("rectangles")
    points[[2, 5], 1] = 0.5
    known = forgotten(specimen(points, own, seed=5))
    found = recover(known.matrix, scale=1.0)
    assert found.certified, found.reason
    assert found.n_polygons == 2


def test_rows_and_cells_are_in_the_report():
    star = np.array([[0.0, 0], [1, 0], [0, 2], [-3, 0], [0, -1.5]])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
    found = recover(forgotten(specimen(star, triangles)).matrix)
    assert found.status == "ambiguous"
    assert "can as well stand in the order" in found.reason
    assert found.backward_error < 1e-12
    (other,) = found.report()["alternatives"]
    (hub,) = other["around"]
    assert all(hub in cell for cell in other["cells"] + other["other_cells"])
    assert set(other["found"]) == set(other["other"]) == set(range(5)) - {hub}
    assert other["same_scale"] is False
    for cell in other["cells"]:
        assert "-".join(map(str, cell)) in found.reason


@pytest.mark.parametrize("mesh", [squares(holes(6, 5), crossed=True), squares(holes(7, 7, (2, 2, 3, 3)), crossed=True),
                                  refined(4, 1)])  # fmt: skip
def test_meshes_without_narrow_places_have_one_reading(mesh):
    assert recover(forgotten(specimen(*mesh)).matrix).certified


@pytest.mark.parametrize("seed", range(4))
def test_twins_that_are_no_mirror_images(seed):
    """The vertices (1, 0) and (1, 1) have the same neighbours and entries, and one of them two cells of its own."""
    points = [[0, 0], [1, 0], [2, 0], [1, 1], [-1, 1], [3, 1], [0.2, -1.3], [1.8, -1.1], [-1.5, -0.4], [3.2, -0.3]]
    triangles = [[0, 1, 3], [1, 2, 3], [0, 3, 4], [3, 2, 5], [0, 4, 8], [0, 8, 6], [2, 9, 5], [2, 7, 9], [6, 10, 7]]
    known = forgotten(specimen(np.array([*points, [1, -2.5]]), np.array(triangles), c=1.7, seed=seed))
    found = recover(known.matrix)
    assert found.status == "ambiguous"
    assert found.backward_error < 1e-12
    (other,) = found.alternatives
    assert len(other.cells) == len(other.other_cells) == 2
    assert other.other == other.found[::-1]
    assert np.allclose(np.abs(np.subtract(*known.points[list(other.found)])), [0, 1])


def test_noise_leaves_twins_in_doubt():
    known = forgotten(specimen(*SAME["one row of crossed squares"], seed=1))
    upper = sp.triu(known.matrix, 1).tocoo()
    value = upper.data + 1e-6 * np.random.default_rng(0).standard_normal(upper.nnz)
    ends = np.r_[upper.row, upper.col], np.r_[upper.col, upper.row]
    found = recover(sp.coo_array((np.r_[value, value], ends), shape=known.matrix.shape), noise=1e-6)
    assert found.status == "ambiguous"
    assert found.alternatives


def permuted_laplacian(graph, seed):
    matrix = sp.csr_array(networkx.laplacian_matrix(graph).astype(float))
    order = np.random.default_rng(seed).permutation(len(graph))
    return sp.csr_array(matrix[order][:, order])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "graph", [networkx.octahedral_graph(), networkx.grid_2d_graph(3, 3)], ids=["octahedron", "nine rows"]
)
def test_symmetric_graphs_whose_cells_and_holes_may_change_places(graph, seed):
    found = recover(permuted_laplacian(graph, seed))
    assert found.status == "ambiguous"
    assert found.alternatives
    assert "so does another" in found.reason


@pytest.mark.parametrize("seed", range(2))
def test_long_paths_are_not_certified(seed):
    found = recover(permuted_laplacian(networkx.path_graph(150), seed))
    assert found.status == "ambiguous"


def test_right_angle_where_every_row_has_three_neighbours():
    """An annulus whose outer side a-c faces a right angle at b: there are no rows that could be twins."""
    points, triangles = polar(3, 12, 0.5)
    points = points * (1 + 0.05 * np.random.default_rng(0).random((len(points), 1)))
    outer = np.hypot(*points.T) > 1.9
    a, b, c = next(np.roll(t, 1 - k) for t in triangles for k in range(3) if outer[np.delete(t, k)].all())
    middle = (points[a] + points[c]) / 2
    inwards = (points[c] - points[a])[::-1] * [1, -1]
    points[b] = middle - 0.5 * inwards * np.sign(inwards @ middle)
    known = forgotten(specimen(points, triangles, c=-2.0, seed=3))
    assert np.diff(known.matrix.indptr).min() == 4
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert largest_error(found.points, known.points) <= 1e-12


@pytest.mark.parametrize("seed", [208, 248, 426])
def test_meshes_that_differ_by_two_corners(seed):
    """Of meshes with the same entries and the same c, found by turning two labels over: none is certified."""
    known, c = member("integer", seed)
    matrix = known.matrix
    found = recover(matrix)
    assert found.status == "ambiguous"
    assert found.alternatives
    for other in found.alternatives:
        gone = {tuple(sorted(cell)) for cell in other.cells}
        kept = [cell for cell in cells_of(found) if tuple(sorted(cell)) not in gone]
        assert explains(matrix, [*kept, *other.other_cells], c)


@pytest.mark.parametrize("seed", [22, 452, 455])
def test_a_place_on_a_side_makes_no_other_mesh(seed):
    """With a vertex there the entries are the same, but between it and the cell beyond there would be a crack."""
    known, _ = member("integer", seed)
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert largest_error(found.points, known.points) <= 1e-10


@pytest.mark.parametrize(("turn", "k"), [(0.0, 8), (0.3, 8), (0.0, 31)])
def test_a_vertex_with_two_places(turn, k):
    """In a hole of a grid, a right angle between two vertices of its rim: its mirror image may have one as well."""
    points, triangles = squares(holes(k, k, (3, 3, 3, 2)))
    at = {tuple(point): v for v, point in enumerate(points.round().astype(int).tolist())}
    a, b, p, q = at[5, 3], at[5, 5], at[4, 5], at[4, 3]
    h = len(points)
    points = np.vstack([points, [5 - np.cos(turn), 4 + np.sin(turn)]])
    triangles = np.vstack([triangles, [[h, a, b], [h, b, p], [h, q, a]]])
    known = forgotten(specimen(points, triangles, c=-2.5, seed=k))
    found = recover(known.matrix)
    assert found.certified == (turn > 0)
    assert len(found.alternatives) == (turn == 0)
    for other in found.alternatives if k == 8 else ():
        gone = {tuple(sorted(cell)) for cell in other.cells}
        kept = [cell for cell in cells_of(found) if tuple(sorted(cell)) not in gone]
        assert explains(known.matrix, [*kept, *other.other_cells], -2.5)
