"""Symmetries of weighted graphs are all found, and none that are not."""

import networkx
import numpy as np
import pytest
import scipy.sparse as sp
from networkx.algorithms.isomorphism import GraphMatcher, numerical_edge_match

from unassemble.topology.symmetries import symmetries

AGREE = 1e-9


def weighted(graph, seed, kinds):
    """The graph with its vertices in random order and weights of a few kinds."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(graph)).tolist()
    place = dict(zip(graph, order, strict=True))
    edges = np.array(sorted(tuple(sorted((place[a], place[b]))) for a, b in graph.edges))
    return edges, rng.integers(1, kinds + 1, len(edges)).astype(float)


def orbits(n, permutations):
    """Smallest vertex that each is moved to, in any number of steps."""
    pairs = np.array([pair for rows, images in permutations for pair in zip(rows, images, strict=True)], dtype=int)
    graph = sp.coo_array((np.ones(len(pairs)), pairs.reshape(-1, 2).T), shape=(n, n))
    label = sp.csgraph.connected_components(graph, directed=False)[1]
    return [int(np.argmax(label == label[k])) for k in range(n)]


GRAPHS = {
    "path": networkx.path_graph(7),
    "star": networkx.star_graph(6),
    "tree": networkx.balanced_tree(2, 3),
    "grid": networkx.convert_node_labels_to_integers(networkx.grid_2d_graph(3, 4)),
    "octahedron": networkx.octahedral_graph(),
    "wheel": networkx.wheel_graph(7),
    "two squares": networkx.disjoint_union(networkx.cycle_graph(4), networkx.cycle_graph(4)),
    "lattice": networkx.convert_node_labels_to_integers(networkx.triangular_lattice_graph(3, 4)),
    "dodecahedron": networkx.dodecahedral_graph(),
}


@pytest.mark.parametrize("kinds", [1, 2])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", GRAPHS)
def test_orbits_are_those_of_all_automorphisms(name, seed, kinds):
    edges, weights = weighted(GRAPHS[name], seed, kinds)
    n = len(GRAPHS[name])
    graph = networkx.Graph()
    graph.add_nodes_from(range(n))
    graph.add_weighted_edges_from((*edge, weight) for edge, weight in zip(edges.tolist(), weights, strict=True))
    matcher = GraphMatcher(graph, graph, edge_match=numerical_edge_match("weight", 1.0))
    every = [(list(one), list(one.values())) for one in matcher.isomorphisms_iter()]
    assert orbits(n, symmetries(n, edges, weights, AGREE)) == orbits(n, every)


def test_what_is_found_changes_no_weight():
    edges, weights = weighted(GRAPHS["lattice"], 0, 1)
    n = len(GRAPHS["lattice"])
    matrix = sp.coo_array((weights, edges.T), shape=(n, n)).toarray()
    matrix += matrix.T
    found = list(symmetries(n, edges, weights, AGREE))
    assert found
    for rows, images in found:
        order = np.arange(n)
        order[rows] = images
        assert (matrix[np.ix_(order, order)] == matrix).all()


def test_small_symmetric_parts_of_a_large_graph():
    """Chains on three vertices of a path of 1,500, two of which are alike; rounds of refinement are limited there."""
    n, edges = 1500, [(k, k + 1) for k in range(1499)]
    for hub, count in ((300, 2), (700, 1), (701, 1)):
        for _ in range(count):
            edges += [(hub, n), (n, n + 1)]
            n += 2
    edges = np.array(sorted(edges))
    weights = 1 + edges.sum(axis=1) * (edges.max(axis=1) < 1500)
    ((rows, images),) = symmetries(n, edges, weights.astype(float), AGREE)
    assert {frozenset(pair) for pair in zip(rows.tolist(), images.tolist(), strict=True)} == {
        frozenset((1500, 1502)),
        frozenset((1501, 1503)),
    }


def test_weights_that_agree_as_far_as_they_are_known():
    edges, weights = np.array([[0, 1], [0, 2]]), np.array([1.0, 1.001])
    assert not list(symmetries(3, edges, weights, AGREE))
    assert len(list(symmetries(3, edges, weights, 1e-2))) == 1
