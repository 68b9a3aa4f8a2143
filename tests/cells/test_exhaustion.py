"""Ambiguity against the oracle that tries every set of cells."""

import networkx
import numpy as np
import pytest

from exhaustive import all_meshes, matrix_of, named
from meshes import delaunay, edge_list, specimen
from unassemble import recover
from unassemble.cells.alternatives.exhaustion import TooManyError, all_readings
from unassemble.cells.by_component import with_pieces
from unassemble.topology import components, recognise
from vanishing import holes, squares, used, without_zeros

TREES = [tree for n in (3, 4, 5) for tree in networkx.nonisomorphic_trees(n)]
GRAPHS = [
    networkx.cycle_graph(4),
    networkx.cycle_graph(5),
    networkx.Graph([(0, 1), (1, 2), (2, 0), (1, 3), (2, 3)]),
    networkx.Graph([(0, 1), (1, 2), (2, 0), (2, 3)]),
    networkx.Graph([(0, 1), (1, 2), (2, 0), (2, 3), (2, 4)]),
    networkx.Graph([(0, 1), (1, 2), (2, 0), (2, 3), (1, 4)]),
    networkx.Graph([(0, 1), (1, 2), (2, 0), (2, 3), (3, 4)]),
    networkx.Graph([(0, 1), (1, 2), (2, 3), (3, 0), (0, 4)]),
]


def cells_of(found):
    ends = zip(found.polygons_offsets[:-1], found.polygons_offsets[1:], strict=True)
    polygons = [tuple(found.polygons_data[a:b].tolist()) for a, b in ends]
    return {named(cell) for cell in [*map(tuple, found.triangles.tolist()), *polygons]}


def check(n, weights, c=None):
    """A mesh is certified exactly if there is no other; what is named in its place is one of the others."""
    known = all_meshes(n, weights, c)
    found = recover(matrix_of(n, weights), scale=c)
    cells = cells_of(found)
    if c is not None and found.backward_error > 1e-9:  # the search has failed, and says so
        assert not found.certified
        assert not found.alternatives
        return found
    assert cells in known
    assert found.certified == (len(known) == 1), found.reason
    for other in found.alternatives:
        gone, new = ({named(cell) for cell in some} for some in (other.cells, other.other_cells))
        assert gone <= cells
        assert (cells - gone) | new in known
    return found


@pytest.mark.parametrize("graph", TREES + GRAPHS, ids=str)
def test_random_weights(graph):
    rng = np.random.default_rng(graph.number_of_edges())
    row = rng.permutation(len(graph))
    weights = {tuple(sorted((int(row[a]), int(row[b])))): float(rng.uniform(0.5, 2)) for a, b in graph.edges}
    found = check(len(graph), weights)
    assert recover(matrix_of(len(graph), weights), scale=found.scale[0]).certified  # at most one fits each c


@pytest.mark.parametrize("graph", TREES + GRAPHS, ids=str)
def test_the_library_tries_all_sets_of_cells_as_well(graph):
    rng = np.random.default_rng(graph.number_of_edges())
    edges = np.array(sorted(tuple(sorted(edge)) for edge in graph.edges))
    weights = rng.uniform(0.5, 2, len(edges))
    (part,) = components(len(graph), edges)
    found = [frozenset(cells) for cells, _ in all_readings(part, weights[part.edge_rows], agree=0.0)]
    known = all_meshes(len(graph), dict(zip(map(tuple, edges.tolist()), weights.tolist(), strict=True)))
    assert len(set(found)) == len(found) == len(known)
    assert set(found) == set(known)


def test_a_long_path_is_too_much():
    edges = np.column_stack([np.arange(60), np.arange(1, 61)])
    (part,) = components(61, edges)
    with pytest.raises(TooManyError):
        list(all_readings(part, np.random.default_rng(0).uniform(0.5, 2, 60), agree=0.0))


def test_pieces_by_component():
    _, triangles = delaunay(np.random.default_rng(0).random((6, 2)))
    many = np.concatenate([triangles + 6 * k for k in range(5)])
    row = np.random.default_rng(1).permutation(32)
    many = row[np.concatenate([many, [[30, 31, 0]]])]
    edges = edge_list(many)
    pieces = recognise(32, edges).pieces
    found = with_pieces(32, edges, pieces)
    assert len(found) == 5
    assert sorted(len(own) for _, own in found) == [1, 1, 1, 1, 2]
    for part, own in found:
        assert set(np.concatenate([piece.vertices for piece in own]).tolist()) == set(part.vertices.tolist())


@pytest.mark.parametrize("c", [None, 1.0])
@pytest.mark.parametrize("seed", [0, 1, 3, 4])
def test_pieces_of_crossed_squares(seed, c):
    """Equal entries make coincidences, whether or not the factor is known."""
    rng = np.random.default_rng(seed)
    points, triangles = squares(holes(2, 2), crossed=True)
    chosen = [int(rng.integers(len(triangles)))]
    for _ in range(3):
        shared = np.array([max(len(np.intersect1d(t, triangles[k])) for k in chosen) for t in triangles])
        chosen.append(int(rng.choice(np.flatnonzero(shared == 2))))
    known = specimen(*used(points, triangles[chosen]), seed=seed)
    upper = without_zeros(known.matrix).tocoo()
    weights = {(int(i), int(j)): -float(w) for i, j, w in zip(upper.row, upper.col, upper.data, strict=True) if i < j}
    graph = networkx.Graph(list(weights))
    if len(graph) < len(known.points) or not networkx.is_connected(graph):
        pytest.skip("falls to pieces without its zeros")
    check(len(known.points), weights, c)
