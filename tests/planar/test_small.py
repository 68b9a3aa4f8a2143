"""Small and degenerate meshes, each from its matrix alone."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse import csgraph
from scipy.spatial import Delaunay

from meshes import delaunay, largest_error, specimen, triangle_set
from unassemble import recover


def certified(points, triangles, *, seed=0, error=1e-10, digits=1e-9, c=-2.5, scale=None):
    known = specimen(points, triangles, c=c, seed=seed)
    found = recover(known.matrix, scale=scale)
    assert found.status == "certified", found.reason
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
    assert largest_error(found.points, known.points) <= error
    assert abs(found.scale[0] / c - 1) <= digits
    return found


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("count", [1, 2])
def test_one_or_two_triangles(count, seed):
    """As many entries as unknowns: two coordinates for each further vertex, and c."""
    rng = np.random.default_rng(seed)
    points = np.array([[0, 0], [1, 0], [0.4, 0.9], [1.3, 1.1]])[: count + 2] + rng.uniform(-0.2, 0.2, (count + 2, 2))
    triangles = np.array([[0, 1, 2], [1, 3, 2]])[:count]
    certified(points, triangles, seed=seed, scale=-2.5)


@pytest.mark.parametrize("count", [3, 4, 10, 40])
def test_fan_about_a_boundary_vertex(count):
    """No vertex lies inside; the last fan turns by nearly a full angle, with obtuse and flat triangles."""
    rng = np.random.default_rng(count)
    angle = np.cumsum(rng.uniform(0.5, 1.5, count + 1))
    angle *= min(1.0, 0.9 * 2 * np.pi / angle[-1])
    rim = rng.uniform(0.5, 2, (count + 1, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])
    first = np.arange(1, count + 1)
    triangles = np.column_stack([np.zeros_like(first), first, first + 1])
    points = np.concatenate([[[0, 0]], rim])
    certified(points, triangles, seed=count, scale=-2.5)
    found = recover(specimen(points, triangles, seed=count).matrix)
    assert found.status == "uncertified"
    assert "no entry to spare" in found.reason


@pytest.mark.parametrize("sectors", [4, 7, 30, 200])
def test_ring_one_element_wide(sectors):
    rng = np.random.default_rng(sectors)
    angle = 2 * np.pi * (np.arange(sectors) + rng.uniform(-0.2, 0.2, sectors)) / sectors
    inner, outer = (radius + rng.uniform(-0.1, 0.1, sectors) for radius in (1, 1.6))
    z = np.concatenate([inner, outer]) * np.exp(1j * np.tile(angle, 2))
    k, following = np.arange(sectors), np.roll(np.arange(sectors), -1)
    triangles = np.concatenate(
        [np.column_stack([k, k + sectors, following]), np.column_stack([following, k + sectors, following + sectors])]
    )
    assert certified(np.column_stack([z.real, z.imag]), triangles).n_holes == 1


@pytest.mark.parametrize("degrees", [1.0, 0.05, 0.002])
def test_slivers(degrees):
    """Columns squeezed until the triangles' smallest angle is of that size."""
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.arange(9.0), np.arange(9.0))
    points = np.column_stack([x.ravel(), y.ravel()]) + rng.uniform(-0.25, 0.25, (81, 2))
    triangles = Delaunay(points).simplices.astype(np.int64)
    middle = points[triangles].mean(axis=1)
    triangles = triangles[np.abs(middle - 4).max(axis=1) < 3.3]
    points[:, 0] *= np.deg2rad(degrees)
    used, triangles = np.unique(triangles, return_inverse=True)
    certified(points[used], triangles.reshape(-1, 3), error=1e-9, digits=1e-7)


@pytest.mark.parametrize("stretch", [3.0, 10.0, 60.0])
def test_obtuse_triangles(stretch):
    """A sheared and stretched mesh: many edges have negative weights."""
    rng = np.random.default_rng(int(stretch))
    points, triangles = delaunay(rng.random((150, 2)), longest=0.3)
    points = points @ np.array([[1.0, 0.4 * stretch], [0.0, stretch]])
    known = specimen(points, triangles)
    assert (known.matrix.data[known.matrix.data > 0].size - len(points)) > 100
    certified(points, triangles, error=1e-9)


def test_sixty_four_holes():
    rng = np.random.default_rng(64)
    k = 60
    x, y = np.meshgrid(np.arange(k), np.arange(k))
    points = np.column_stack([x.ravel(), y.ravel()]) + rng.uniform(-0.25, 0.25, (k * k, 2))
    triangles = Delaunay(points).simplices.astype(np.int64)
    middle = points[triangles].mean(axis=1)
    kept = np.abs(middle - (k - 1) / 2).max(axis=1) < (k - 3) / 2
    grid = 4 + (k - 9) / 7 * np.arange(8)
    for a in grid:
        for b in grid:
            kept &= np.hypot(middle[:, 0] - a, middle[:, 1] - b) > rng.uniform(1.2, 1.9)
    # Of one piece: triangles that hang on the rim of a hole by two vertices have a mirror image that fits as well.
    triangles = triangles[kept]
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    side = np.unique(sides, axis=0, return_inverse=True)[1].ravel()
    touches = sp.coo_array((np.ones(len(side)), (np.arange(len(side)) // 3, side))).tocsr()
    label = csgraph.connected_components(touches @ touches.T, directed=False)[1]
    used, triangles = np.unique(triangles[label == np.bincount(label).argmax()], return_inverse=True)
    assert certified(points[used], triangles.reshape(-1, 3)).n_holes == 64
