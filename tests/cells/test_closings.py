"""Vertices inside that one right angle closes, its far side vanished: without it there is a mesh with another c."""

import numpy as np
import pytest

from meshes import specimen, triangle_set
from unassemble import recover
from vanishing import forgotten


def closed_fan(rng, count):
    """So many triangles about a vertex, and one with a right angle there; in running order about it."""
    angle = rng.dirichlet(np.full(count, 8.0)) * 1.5 * np.pi
    rim = rng.uniform(0.8, 1.25, count + 1) * np.exp(1j * np.append(0, np.cumsum(angle)))
    triangles = [(0, k, k + 1) for k in range(1, count + 1)]
    return np.append(0, rim), np.array([*triangles, (0, count + 1, 1)])


def two_closed_fans(rng):
    """With the first sides of their rims in common."""
    z, triangles = closed_fan(rng, 5)
    w, others = closed_fan(rng, 4)
    w = z[2] + (w - w[1]) * (z[1] - z[2]) / (w[2] - w[1])
    number = np.array([7, 2, 1, *range(8, 8 + len(w) - 3)])
    return np.concatenate([z, w[[0]], w[3:]]), np.concatenate([triangles, number[others]])


def known_of(mesh, seed):
    z, triangles = mesh
    return forgotten(specimen(np.column_stack([z.real, z.imag]), triangles, c=-40.0, seed=seed))


@pytest.mark.parametrize("count", [3, 4, 6])
@pytest.mark.parametrize("seed", range(3))
def test_a_fan_that_a_right_angle_closes(count, seed):
    known = known_of(closed_fan(np.random.default_rng(seed), count), seed)
    found = recover(known.matrix)
    assert not found.certified
    mine, (other,) = triangle_set(found.triangles), found.alternatives
    assert (mine - set(other.cells)) | set(other.other_cells) == triangle_set(known.triangles)
    assert "so does another" in found.reason
    told = recover(known.matrix, scale=-40.0)
    assert told.certified, told.reason
    assert triangle_set(told.triangles) == triangle_set(known.triangles)


@pytest.mark.parametrize("seed", range(4))
def test_two_fans_that_right_angles_close_at_once(seed):
    known = known_of(two_closed_fans(np.random.default_rng(seed)), seed)
    found = recover(known.matrix)
    assert not found.certified
    assert found.alternatives


@pytest.mark.parametrize("seed", range(3))
def test_fans_that_no_right_angle_closes_are_certified(seed):
    z, triangles = closed_fan(np.random.default_rng(seed), 5)
    found = recover(known_of((z, triangles[:-1]), seed).matrix)
    assert found.certified, found.reason
