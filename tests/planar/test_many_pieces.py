"""Matrices of very many pieces: chains, components, lone triangles."""

import numpy as np
import pytest

from meshes import largest_error, random_mesh, specimen
from unassemble import recover
from unassemble.topology import components


def chain(count, seed=0):
    """Triangles on both sides of a line, each of which shares a vertex with the next."""
    rng = np.random.default_rng(seed)
    at = np.arange(count + 1) + rng.uniform(-0.2, 0.2, count + 1)
    apex = np.column_stack([np.arange(count) + rng.uniform(0, 1, count), rng.choice([-1, 1], count)])
    points = np.concatenate([np.column_stack([at, np.zeros(count + 1)]), apex])
    k = np.arange(count)
    triangles = np.column_stack([k, k + 1, count + 1 + k])
    triangles[apex[:, 1] < 0] = triangles[apex[:, 1] < 0][:, [0, 2, 1]]
    return points, triangles


@pytest.mark.parametrize("scale", [pytest.param(None, marks=pytest.mark.slow), -2.5])
def test_a_chain_is_joined_from_triangle_to_triangle(scale):
    known = specimen(*chain(2000), c=-2.5)
    found = recover(known.matrix, scale=scale)
    assert found.certified == (scale is not None), found.reason  # a triangle has as many unknowns as entries
    assert (found.n_components, len(found.hinges)) == (2000, 1999)
    assert found.scale == pytest.approx(-2.5, rel=1e-9)
    for rows in known.triangles[::50]:
        assert largest_error(found.points[rows], known.points[rows]) < 1e-9


def test_components_are_numbered_by_themselves():
    points, triangles = random_mesh(40, seed=1)
    n = len(points)
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    one = np.unique(np.sort(ends, axis=1), axis=0)
    rng = np.random.default_rng(0)
    row = rng.permutation(2 * n + 4)
    edges = np.sort(np.concatenate([row[one], row[one + n], [row[-3:-1]]]), axis=1)
    edges = edges[np.lexsort(edges.T[::-1])]
    parts = components(len(row), edges)
    assert [len(part.edges) for part in parts] == [len(one), len(one), 1]
    assert sorted(np.concatenate([part.edge_rows for part in parts]).tolist()) == list(range(len(edges)))
    for part in parts:
        assert (part.vertices[part.edges] == edges[part.edge_rows]).all()
        assert (np.diff(part.vertices) > 0).all()
        assert set(part.edges.ravel().tolist()) == set(range(len(part.vertices)))
