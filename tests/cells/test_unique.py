"""Whether other cells fit as well: meshes with the same matrix are named, and what proves nothing is not certified."""

from contextlib import suppress

import networkx
import numpy as np
import pytest
import scipy.sparse as sp

from families import member
from meshes import random_mesh, specimen, triangle_set
from unassemble import RecoveryError, recover
from vanishing import forgotten, holes, squares, without_zeros


def weighted(graph, seed=0):
    """A graph with random weights, rows in random order."""
    rng = np.random.default_rng(seed)
    n = len(graph)
    i, j = np.array(graph.edges).T
    row = rng.permutation(n)
    w = rng.uniform(0.5, 2, len(i))
    return sp.coo_array((np.r_[-w, -w], (row[np.r_[i, j]], row[np.r_[j, i]])), shape=(n, n)).tocsr()


# Corners that change places, rectangles that touch in a vertex, vertices with two places: each has another mesh.
@pytest.mark.parametrize(
    ("family", "seed"),
    [("crossed", 3), ("crossed", 4), ("grid", 0), ("grid", 1), ("grid", 4), ("stairs", 2), ("stairs", 3)],
)
@pytest.mark.parametrize("order", range(2))
def test_other_meshes_are_named(family, seed, order):
    found = recover(member(family, seed, order)[0].matrix)
    assert found.status == found.uniqueness == "ambiguous"
    assert "but so does another" in found.reason
    assert all(other.cells or other.other_cells for other in found.alternatives)


BANDS = {
    "one row of crossed squares": squares(holes(4, 1), crossed=True),
    "a row between the outside and a hole": squares(holes(8, 8, (5, 1, 2, 2)), crossed=True),
    "an arch": squares(holes(5, 4, (2, 1, 1, 3)), crossed=True),
}


@pytest.mark.parametrize("c", [None, -3.0])
@pytest.mark.parametrize("name", BANDS)
def test_parts_that_can_be_turned_over(name, c):
    """A known factor does not decide here."""
    known = forgotten(specimen(*BANDS[name], c=-3.0, seed=2))
    assert recover(known.matrix, scale=c).uniqueness == "ambiguous"


@pytest.mark.parametrize("turn", [0.0, 0.1])
def test_a_vertex_with_two_places(turn):
    """In a hole of a grid, a right angle between two vertices of its rim: its mirror image may have one as well."""
    points, triangles = squares(holes(8, 8, (3, 3, 3, 2)))
    at = {tuple(point): v for v, point in enumerate(points.round().astype(int).tolist())}
    a, b, p, q = at[5, 3], at[5, 5], at[4, 5], at[4, 3]
    h = len(points)
    points = np.vstack([points, [5 - np.cos(turn), 4 + np.sin(turn)]])
    triangles = np.vstack([triangles, [[h, a, b], [h, b, p], [h, q, a]]])
    found = recover(forgotten(specimen(points, triangles, c=-2.5, seed=8)).matrix)
    assert found.certified == (turn > 0)
    assert (found.uniqueness == "ambiguous") == (turn == 0)


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
    found = recover(without_zeros(known.matrix))
    assert (found.status, found.uniqueness) == ("certified", "searched")
    assert triangle_set(found.triangles) == triangle_set(known.triangles)


def test_a_boundary_that_shows_in_the_graph_is_proved():
    assert recover(specimen(*random_mesh(100, seed=3), c=-2.0).matrix).uniqueness == "proved"


LOOSE = {
    "path": networkx.path_graph(4),
    "star": networkx.star_graph(4),
    "triangle": networkx.cycle_graph(3),
    "triangle and a path": networkx.Graph([(0, 1), (1, 2), (2, 0), (2, 3), (3, 4)]),
    "square": networkx.cycle_graph(4),
    "two triangles and an edge": networkx.Graph([(0, 1), (1, 2), (2, 0), (1, 3), (2, 3), (2, 4)]),
    "fan": networkx.Graph([(0, k) for k in range(1, 6)] + [(k, k + 1) for k in range(1, 5)]),
}


@pytest.mark.parametrize("name", LOOSE)
def test_as_many_unknowns_as_entries_prove_nothing(name):
    found = recover(weighted(LOOSE[name], seed=len(name)))
    assert found.status == "uncertified"
    assert found.backward_error < 1e-9
    assert "no entry to spare" in found.reason


def strip(rng):
    """24 triangles, no vertex inside."""
    x = np.arange(13) + rng.uniform(-0.2, 0.2, 13)
    points = np.concatenate([np.column_stack([x, rng.uniform(-0.2, 0.2, 13)]), np.column_stack([x, np.ones(13)])])
    i = np.arange(12)
    triangles = np.concatenate([np.column_stack([i, i + 1, 13 + i]), np.column_stack([i + 1, 14 + i, 13 + i])])
    return points, triangles


@pytest.mark.parametrize("spoilt", ["biharmonic", "entry", "jump"])
def test_strips_fit_nearly_anything(spoilt):
    rng = np.random.default_rng(3)
    if spoilt == "biharmonic":
        matrix = sp.diags_array([1.0, -4.0, -4.0, 1.0], offsets=[-2, -1, 1, 2], shape=(20, 20)).tocsr()
    else:
        points, triangles = strip(rng)
        if spoilt == "jump":
            halves = [specimen(points, some).matrix for some in (triangles[::2], triangles[1::2])]
            matrix = halves[0] + 10 * halves[1]
        else:
            matrix = specimen(points, triangles).matrix.tolil()
            i, j = next((a, b) for a, b in zip(*matrix.tocoo().coords, strict=True) if a != b)
            matrix[i, j] = matrix[j, i] = 1.3 * matrix[i, j]
            matrix = matrix.tocsr()
    with suppress(RecoveryError):
        assert not recover(matrix).certified


def test_no_certificate_while_a_stored_zero_lies_in_no_cell():
    points = np.array([[2, 4], [4, 0], [3, 2], [2, 3], [0, 2], [2, 2], [1, 1], [4, 3]], dtype=float)
    triangles = np.array([[6, 5, 4], [3, 7, 0], [3, 0, 4], [5, 3, 4], [2, 3, 5], [3, 2, 7], [7, 2, 1], [6, 2, 5],
                          [2, 6, 1]])  # fmt: skip
    for seed in range(4):
        known = specimen(points, triangles, seed=seed)
        place = [int(np.abs(known.points - (p - points.mean(axis=0))).sum(axis=1).argmin()) for p in points]
        entries = without_zeros(known.matrix).tocoo()
        i, j = place[1], place[6]
        ends = np.r_[entries.row, i, j], np.r_[entries.col, j, i]
        found = recover(sp.coo_array((np.r_[entries.data, 0.0, 0.0], ends), shape=entries.shape))
        if found.certified:
            assert triangle_set(found.triangles) == triangle_set(known.triangles)


def test_a_known_factor_out_of_nowhere_ends_in_no_crash():
    """Edges 0-4, 1-4, 2-4, 3-4 of weight 1, zeros stored at 0-3 and 1-2."""
    i, j, w = np.array([0, 1, 2, 3, 0, 1]), np.array([4, 4, 4, 4, 3, 2]), np.array([1.0, 1, 1, 1, 0, 0])
    matrix = sp.coo_array((-np.r_[w, w], (np.r_[i, j], np.r_[j, i])), shape=(5, 5))
    with suppress(RecoveryError):
        assert not recover(matrix).certified
