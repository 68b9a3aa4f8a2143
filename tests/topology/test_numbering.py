"""Renumbering: the same graph, neighbours near each other, and the same topology."""

import numpy as np

from meshes import edge_list
from unassemble.topology import local_numbering, surfaces


def grid(k: int, seed: int) -> tuple[int, np.ndarray]:
    """Edges of a k x k square cut into triangles, vertices in random order."""
    corner = (np.arange(k - 1)[:, None] * k + np.arange(k - 1)).ravel()
    triangles = np.concatenate(
        [np.column_stack([corner, corner + 1, corner + k + 1]), np.column_stack([corner, corner + k + 1, corner + k])]
    )
    return k * k, edge_list(np.random.default_rng(seed).permutation(k * k)[triangles])


def test_numbering_is_of_the_same_graph_and_local():
    n, edges = grid(40, seed=3)
    found = local_numbering(n, edges)
    assert np.array_equal(np.sort(found.vertices), np.arange(n))
    assert np.array_equal(np.sort(found.vertices[found.edges], axis=1), edges[found.edge_rows])
    key = found.edges[:, 0] * n + found.edges[:, 1]
    assert (found.edges[:, 0] < found.edges[:, 1]).all()
    assert (np.diff(key) > 0).all()
    assert np.ptp(found.edges, axis=1).max() < 5 * 40 < np.ptp(edges, axis=1).mean()


def test_numbering_reaches_every_component_and_isolated_vertices():
    _, edges = grid(5, seed=0)
    edges = np.concatenate([edges, edges + 30])
    found = local_numbering(60, edges)
    assert np.array_equal(np.sort(found.vertices), np.arange(60))
    assert np.array_equal(np.sort(found.vertices[found.edges], axis=1), edges[found.edge_rows])


def test_topology_is_the_same_in_any_numbering():
    n, edges = grid(12, seed=1)
    (plain,) = surfaces(n, edges).pieces
    (local,) = surfaces(n, edges, local_numbering(n, edges)).pieces

    def triangles(piece):
        return {tuple(sorted(t)) for t in piece.vertices[piece.triangles].tolist()}

    assert triangles(local) == triangles(plain)
    assert np.array_equal(np.sort(local.vertices[local.edges], axis=1), edges[local.edge_rows])
    rows = np.array([7, 3, 100])
    assert np.array_equal(local.vertices[local.local(rows)], rows)
