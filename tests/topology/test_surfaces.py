"""Faces, orientation, loops and pieces from graphs."""

import itertools
import sys

import networkx
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial import Delaunay

from meshes import delaunay, edge_list, random_mesh, triangle_set
from unassemble import NotPlanarError
from unassemble.topology import loops, require_planar, separating, surfaces, three_cycles


def shuffled(triangles, n, seed=0):
    return np.random.default_rng(seed).permutation(n)[triangles]


@settings(max_examples=50, deadline=None, derandomize=True)
@given(n=st.integers(3, 25), probability=st.floats(0, 1), seed=st.integers(0, 999))
def test_three_cycles_are_those_of_networkx(n, probability, seed):
    graph = networkx.gnp_random_graph(n, probability, seed=seed)
    edges = np.array(sorted(map(sorted, graph.edges())), dtype=np.int64).reshape(-1, 2)
    triangles, opposite = three_cycles(n, edges)
    expected = {
        triple
        for triple in itertools.combinations(range(n), 3)
        if all(graph.has_edge(*pair) for pair in itertools.combinations(triple, 2))
    }
    assert triangle_set(triangles) == expected
    assert len(triangles) == len(expected)
    for corner in range(3):
        facing = np.sort(np.delete(triangles, corner, axis=1), axis=1)
        assert (edges[opposite[:, corner]] == facing).all()


@settings(max_examples=40, deadline=None, derandomize=True)
@given(n=st.integers(9, 600), seed=st.integers(0, 999))
def test_delaunay_meshes(n, seed):
    points, triangles = random_mesh(n, seed)
    triangles = shuffled(triangles, len(points), seed)
    found = surfaces(len(points), edge_list(triangles))
    assert len(found.pieces) == 1
    check_piece(found.pieces[0])
    assert triangle_set(found.pieces[0].vertices[found.pieces[0].triangles]) == triangle_set(triangles)


def check_piece(piece):
    """Properties that every piece must have."""
    ends = np.sort(piece.triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2)
    assert (piece.edges[piece.opposite] == ends).all()
    half_edges = piece.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    keys = half_edges[:, 0] * piece.n_vertices + half_edges[:, 1]
    assert len(np.unique(keys)) == len(keys)  # consistent orientation: no directed edge twice
    reverse = half_edges[:, 1] * piece.n_vertices + half_edges[:, 0]
    alone = half_edges[~np.isin(keys, reverse)]
    assert set(map(tuple, alone.tolist())) == set(map(tuple, piece.boundary.tolist()))
    for start, stop in zip(piece.loop_offsets[:-1], piece.loop_offsets[1:], strict=True):
        loop = piece.boundary[start:stop]
        assert (loop[:, 1] == np.roll(loop[:, 0], -1)).all()
    euler = piece.n_vertices - len(piece.edges) + len(piece.triangles)
    touching = len(piece.boundary) - len(np.unique(piece.boundary[:, 0]))
    assert euler + touching == 2 - piece.n_loops


def test_vertex_of_degree_three_in_a_triangle():
    points = np.array([[0, 0], [4, 0], [4, 4], [0, 4], [1, 2], [2, 1.1], [2.2, 2.6], [1.8, 1.9], [3, 2]], dtype=float)
    _, triangles = delaunay(points)
    inner = np.argmin([np.abs(points[t].mean(axis=0) - 2).sum() for t in triangles])
    a, b, c = triangles[inner]
    split = np.vstack([np.delete(triangles, inner, axis=0), [[a, b, 9], [b, c, 9], [c, a, 9]]])
    found = surfaces(10, edge_list(split))
    assert triangle_set(found.pieces[0].triangles) == triangle_set(split)


@pytest.mark.parametrize("nested", [1, 2, 5])
@pytest.mark.parametrize("fill", ["vertices of degree three", "triangulated triangle"])
def testseparating_triangles_at_any_depth(nested, fill):
    points, triangles = random_mesh(60, seed=nested)
    cells, n = triangles.tolist(), len(points)
    for k in range(nested):
        a, b, c = cells.pop(7 * k % len(cells) if k % 2 else -1)
        if fill == "vertices of degree three":
            cells += [[a, b, n], [b, c, n], [c, a, n]]
            n += 1
        else:  # three vertices inside, none of degree three: an octahedron without its outside
            d, e, f = n, n + 1, n + 2
            cells += [[a, b, d], [b, c, e], [c, a, f], [a, d, f], [b, e, d], [c, f, e], [d, e, f]]
            n += 3
    cells = shuffled(np.array(cells), n)
    found = surfaces(n, edge_list(cells))
    assert triangle_set(found.pieces[0].triangles) == triangle_set(cells)


@pytest.mark.parametrize("filled", [3, 150])
def test_cycles_with_something_on_both_sides_are_those_of_networkx(filled):
    points, triangles = random_mesh(200, seed=filled, holes=False)
    inside, _ = random_mesh(filled, seed=1, holes=False)
    corners = points[triangles[100]]
    # Of the large filling every vertex is nearer to the corners than the balls of the first rounds reach.
    low, high = inside.min(axis=0), inside.max(axis=0)
    share = 0.4 * (inside - low) / (high - low) + 0.1
    more = corners[0] + share @ (corners[1:] - corners[0])
    edges = edge_list(Delaunay(np.concatenate([points, more])).simplices)
    n = len(points) + len(more)
    graph = networkx.Graph(edges.tolist())
    cycles, _ = three_cycles(n, edges)
    found = separating(n, edges, cycles)
    assert found.any()
    sample = np.random.default_rng(0).permutation(len(cycles))[:40]
    for k in {*np.flatnonzero(found).tolist(), *sample.tolist()}:
        rest = graph.subgraph(set(graph) - set(cycles[k].tolist()))
        parts = [p for p in networkx.connected_components(rest) if all(p & set(graph[v]) for v in cycles[k])]
        assert found[k] == (len(parts) > 1)


def test_ears_and_chords_need_no_embedding():
    # A hexagon of two fans that share one chord, with an ear at each end.
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [4, 3, 5], [1, 6, 2]])
    found = surfaces(7, edge_list(triangles))
    assert triangle_set(found.pieces[0].triangles) == triangle_set(triangles)
    check_piece(found.pieces[0])


def test_boundary_that_touches_itself():
    # A ring of triangles around a hole, pinched where its first and last vertex are one.
    outer, inner = np.arange(8), np.arange(8, 16)
    triangles = []
    for k in range(7):
        triangles += [[outer[k], outer[k + 1], inner[k]], [inner[k], outer[k + 1], inner[k + 1]]]
    triangles = np.array(triangles)
    triangles[triangles == inner[7]] = inner[0]
    found = surfaces(15, edge_list(triangles))
    assert found.n_vertices == 15
    (piece,) = found.pieces
    check_piece(piece)
    assert piece.n_loops == 1
    assert piece.n_holes == 1


def test_hinge_between_pieces():
    triangles = np.array([[0, 1, 2], [2, 3, 4], [4, 5, 6]])
    found = surfaces(7, edge_list(triangles))
    assert len(found.pieces) == 3
    assert found.hinges.tolist() == [2, 4]
    assert [piece.vertices.tolist() for piece in found.pieces] == [[0, 1, 2], [2, 3, 4], [4, 5, 6]]


def test_edges_without_triangles_are_listed():
    triangles = np.array([[0, 1, 2], [1, 3, 2]])
    edges = np.vstack([edge_list(triangles), [[3, 4]]])
    found = surfaces(6, edges)
    assert found.bare_edges.tolist() == [5]
    assert found.undetermined.tolist() == [4, 5]


@pytest.mark.parametrize("fallback", [False, True])
@pytest.mark.parametrize(
    "graph",
    [networkx.complete_graph(5), networkx.complete_bipartite_graph(3, 3), networkx.complete_graph(30)],
    ids=["K5", "K33", "K30"],
)
def test_graphs_that_are_not_planar(graph, fallback, monkeypatch):
    if fallback:
        monkeypatch.setitem(sys.modules, "planarity", None)
    edges = np.array(sorted(map(sorted, graph.edges())), dtype=np.int64)
    with pytest.raises(NotPlanarError):
        require_planar(len(graph), edges)


def test_surfaces_without_boundary_are_none():
    icosahedron = networkx.icosahedral_graph()
    edges = np.array(sorted(map(sorted, icosahedron.edges())), dtype=np.int64)
    assert surfaces(12, edges).pieces == ()


def test_moebius_strip_of_triangles_is_not_taken_for_a_mesh():
    k = 9
    triangles = np.array([[i, i + 1, i + 2] for i in range(2 * k - 1)]) % (2 * k - 1)
    assert surfaces(2 * k - 1, edge_list(triangles)).pieces == ()


def test_loops_of_a_permutation():
    successor = np.array([2, 3, 0, 4, 1, 5])
    loop, order = loops(successor)
    assert [loop[k] for k in (0, 1, 2, 3, 4, 5)] == [0, 1, 0, 1, 1, 2]
    assert order.tolist() == [0, 2, 1, 3, 4, 5]
