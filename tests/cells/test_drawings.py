"""Small graphs with many drawings: vertices of degree three, ears, bridges between two vertices; and the outer face."""

import networkx
import numpy as np
import pytest
from scipy.spatial import Delaunay

from meshes import delaunay, edge_list, random_mesh, specimen, triangle_set
from unassemble import recover
from unassemble.planar import ConformalPencil, ShiftedSearch
from unassemble.topology import not_faces, surfaces, three_cycles
from vanishing import used


def stacked(rng, inside, share):
    """A triangle, divided again and again by a vertex inside of one of its parts; then a share of these removed."""
    points = [np.array(corner) for corner in ([0.0, 0.0], [1.0, 0.1], [0.4, 0.9])]
    triangles = [(0, 1, 2)]
    for vertex in range(3, 3 + inside):
        a, b, c = triangles.pop(int(rng.integers(len(triangles))))
        points.append(rng.dirichlet([3, 3, 3]) @ np.array([points[a], points[b], points[c]]))
        triangles += [(a, b, vertex), (b, c, vertex), (c, a, vertex)]
    kept = rng.permutation(len(triangles))[int(share * len(triangles)) :]
    return used(np.array(points), np.array(triangles)[kept])


def bridges(rng, count):
    """Strips of a disc from its leftmost to its rightmost point, which is all that they have in common."""
    points, triangles = [[-1.0, 0.0], [1.0, 0.0]], []
    height = np.linspace(-1.2, 1.2, 2 * count)
    for low, high in height.reshape(-1, 2):
        x, y = rng.uniform(-0.85, 0.85, 8), rng.uniform(low, high, 8)
        rim = np.sort(rng.uniform(-0.8, 0.8, (2, 3)), axis=1)
        x, y = np.concatenate([x, *rim]), np.concatenate([y, np.full(3, low), np.full(3, high)])
        strip = np.array([*points[:2], *np.column_stack([x, y * (1 - x**2)])])
        cells = Delaunay(strip).simplices
        middle = strip[cells].mean(axis=1)
        level = middle[:, 1] / (1 - middle[:, 0] ** 2)
        cells = cells[(level > low) & (level < high)]
        triangles.append(np.where(cells > 1, cells + len(points) - 2, cells))
        points += strip[2:].tolist()
    return used(np.array(points), np.concatenate(triangles))


def ears(rng, count):
    """A few triangles, on whose sides others are put, on theirs others again."""
    points, triangles = delaunay(rng.random((6, 2)))
    points, triangles = list(points), triangles.tolist()
    while count:
        sides = np.concatenate([np.roll(triangles, k, axis=1)[:, :2] for k in range(3)])
        _, first, times = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
        i = int(rng.choice(first[times == 1]))
        a, b = sides[i].tolist()
        (c,) = set(triangles[i % len(triangles)]) - {a, b}
        along = points[b] - points[a]
        across = np.array([-along[1], along[0]])
        across *= -np.sign(across @ (points[c] - points[a]))
        new = points[a] + rng.uniform(0.2, 0.8) * along + rng.uniform(0.3, 0.8) * across
        if all(np.linalg.norm(new - p) > 0.6 * np.linalg.norm(along) for p in points if p is not points[a]):
            points.append(new)
            triangles.append([b, a, len(points) - 1])
            count -= 1
    return np.array(points), np.array(triangles)


def certified(mesh, seed, c):
    known = specimen(*mesh, c=c, seed=seed)
    found = recover(known.matrix)
    assert found.status == "certified", found.reason
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
    assert found.scale == pytest.approx(c, rel=1e-8)
    given, drawn = (shapes(points, known.triangles) for points in (known.points, found.points))
    assert np.abs(drawn - given).max() <= 1e-8 * np.abs(given).max()


def shapes(points, triangles):
    """The third corner of each triangle, above the others at 0 and 1; pieces may be mirrored."""
    a, b, c = (points @ [1, 1j])[triangles.T]
    third = (c - a) / (b - a)
    return third.real + 1j * np.abs(third.imag)


@pytest.mark.parametrize(("inside", "share", "seed"), [(8, 0.0, 1), (10, 0.2, 2), (12, 0.35, 0)])
def test_vertices_of_degree_three(inside, share, seed):
    certified(stacked(np.random.default_rng(seed), inside, share), seed, -1900.0)


@pytest.mark.parametrize("seed", range(4))
def test_bridges_between_two_vertices(seed):
    certified(bridges(np.random.default_rng(seed), 2 + seed % 3), seed, -0.03)


@pytest.mark.parametrize("seed", [0, 2])
def test_ears_on_ears(seed):
    certified(ears(np.random.default_rng(seed), 8), seed, 7.0)


@pytest.mark.parametrize(("n", "count"), [(30, 3), (400, 0)])
def test_the_outer_face_is_a_triangle_like_all_others(n, count):
    rng = np.random.default_rng(n)
    inside = rng.dirichlet([1.2, 1.2, 1.2], n) @ [[0.0, 0.0], [1.0, 0.1], [0.4, 0.9]]
    points = np.concatenate([[[-0.5, -0.4], [1.9, -0.2], [0.4, 2.0]], inside])
    triangles = Delaunay(points).simplices
    middle = np.flatnonzero((triangles > 2).all(axis=1))[:: len(triangles) // 4][:count]
    certified((points, np.delete(triangles, middle, axis=0)), n, 12.0)


def test_a_vertex_of_degree_three_with_nothing_beyond():
    """Four vertices joined to each other; what else there is hangs on two of them."""
    triangles = np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 1, 4], [1, 2, 5], [2, 0, 6], [1, 4, 7]])
    for seed in range(6):
        number = np.random.default_rng(seed).permutation(8)
        edges = edge_list(number[triangles])
        cycles, opposite = three_cycles(8, edges)
        graph = networkx.Graph(edges.tolist())
        for cycle, false in zip(cycles.tolist(), not_faces(8, edges, cycles, opposite), strict=True):
            rest = networkx.connected_components(graph.subgraph(set(graph) - set(cycle)))
            touching = [part for part in rest if all(part & set(graph[v]) for v in cycle)]
            assert false == (len(touching) > 1)


def test_a_krylov_space_whose_first_vector_has_a_negative_area():
    known = specimen(*random_mesh(100, holes=False))
    edges = edge_list(known.triangles)
    (piece,) = surfaces(len(known.points), edges).pieces
    weights = -np.asarray(known.matrix[edges[:, 0], edges[:, 1]]).ravel()
    pencil = ConformalPencil(piece.n_vertices, piece.edges, piece.boundary, weights[piece.edge_rows])
    z = known.points[piece.vertices] @ [1, 1j]
    image = np.conj(z) if (np.conj(z) @ pencil.area_form(z)).real > 0 else z
    noise = np.random.default_rng(0).standard_normal((len(z), 2)) @ [1, 1j]
    _, c, _ = ShiftedSearch(pencil, 20).at(0.7, image + 1e-3 * noise)
    assert c == pytest.approx(1.0, rel=1e-6)
