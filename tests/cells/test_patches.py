"""Triangular holes close together: patches of triangles between them are told one by one."""

import numpy as np
import pytest

from families import FAMILIES, with_many_holes
from meshes import largest_error, random_mesh, specimen, triangle_set
from unassemble import recover
from unassemble.cells.propagate import told


def sides_of(triangles):
    """(m, 3) edges, and the sum of the cotangents facing each, for the triangles of a mesh of given corners."""
    ends = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2) @ [triangles.max() + 1, 1]
    keys, sides = np.unique(ends, return_inverse=True)
    return len(keys), sides.reshape(-1, 3)


def cotangents(points, triangles):
    """(m, 3) at each corner."""
    z = (points @ [1, 1j])[triangles]
    product = np.conj(np.roll(z, -1, axis=1) - z) * (np.roll(z, 1, axis=1) - z)
    return product.real / np.abs(product.imag)


@pytest.mark.parametrize("seed", range(3))
def test_patches_are_told_without_their_surroundings(seed):
    points, triangles = random_mesh(400, seed, holes=False)
    cells = triangle_set(with_many_holes(points, triangles, np.random.default_rng(seed), 1 / 2)[1])
    n_edges, sides = sides_of(triangles)
    full = np.array([tuple(t) in cells for t in np.sort(triangles, axis=1).tolist()])
    total = np.bincount(sides[full].ravel(), cotangents(points, triangles)[full].ravel(), n_edges)
    state = told(sides, total)
    assert full[state == 1].all()
    assert not full[state == -1].any()
    assert np.count_nonzero(state) > 0.7 * len(sides)


def test_random_numbers_make_no_patches():
    _, triangles = random_mesh(400, 0, holes=False)
    n_edges, sides = sides_of(triangles)
    state = told(sides, np.random.default_rng(0).uniform(0.2, 2, n_edges))
    assert np.count_nonzero(state) < 0.1 * len(sides)  # those on the boundary


@pytest.mark.parametrize("seed", range(4))
def test_every_third_triangle_a_hole(seed):
    """Some two hundred pieces that meet in single vertices, and rings of them that tell their mirror images."""
    rng = np.random.default_rng(seed)
    mesh = with_many_holes(*random_mesh(600, seed, holes=False), rng, [1 / 3, 1 / 2][seed % 2])
    known = specimen(*mesh, c=[1.0, -2.5, 1e-3][seed % 3], seed=seed)
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
    assert largest_error(found.points, known.points) < 1e-8


@pytest.mark.parametrize("seed", [26, 458, 0])
def test_what_peeling_leaves_open(seed):
    """A triangle too many in a ring, which is no wrong entry; clusters of 30 open triangles with eight holes."""
    rng = np.random.default_rng(seed)
    c = float(rng.choice([1.0, -2.5, 1e-3]))  # as benchmarks/cells.py draws them
    known = specimen(*FAMILIES["riddled"](rng), c=c, seed=seed)
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
