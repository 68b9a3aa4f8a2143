"""Holes of three edges in meshes that have no entry to spare."""

import numpy as np
import pytest

from meshes import delaunay, specimen, triangle_set
from unassemble import recover


def ring(seed):
    """Three triangles around a triangular hole."""
    rng = np.random.default_rng(seed)
    inner = np.exp(2j * np.pi * np.arange(3) / 3)
    z = np.concatenate([inner, -2 * inner[[2, 0, 1]]]) + 0.2 * (rng.standard_normal((2, 6)) * [[1], [1j]]).sum(axis=0)
    return np.column_stack([z.real, z.imag]), np.array([(0, 3, 1), (1, 4, 2), (2, 5, 0)])


@pytest.mark.parametrize("seed", range(4))
def test_a_triangle_that_may_be_a_hole_is_named(seed):
    known = specimen(*ring(seed), c=-2.5, seed=seed)
    found = recover(known.matrix)
    assert not found.certified
    if len(found.triangles) == 4:  # filled, with another c
        (other,) = found.alternatives
        assert set(other.cells) == triangle_set(found.triangles) - triangle_set(known.triangles)
        assert "left out as a hole" in found.reason
        assert found.scale[0] != pytest.approx(-2.5, rel=1e-3)


@pytest.mark.parametrize("seed", range(8))
def test_a_given_factor_tells_that_it_is_one(seed):
    known = specimen(*ring(seed), c=-2.5, seed=seed)
    found = recover(known.matrix, scale=-2.5)
    assert found.certified, found.reason
    assert triangle_set(found.triangles) == triangle_set(known.triangles)


def strips_about_two_holes(seed):
    """Pairs of triangles on the sides of two triangular holes, one pair between them; no triangle is alone."""
    rng = np.random.default_rng(seed)
    points, triangles = [0, 1, 0.5 + 0.87j], []

    def outside(a, b, height):
        side = points[b] - points[a]
        points.append((points[a] + points[b]) / 2 + side * (rng.uniform(-0.1, 0.1) - 1j * height * rng.uniform(0.7, 1)))
        return len(points) - 1

    def strip(a, b):
        p = outside(a, b, 0.6)
        q = outside(p, b, 0.5)
        triangles.extend([(b, a, p), (b, p, q)])
        return q

    q = strip(0, 1)
    strip(1, 2), strip(2, 0)
    r = outside(q, 1, 0.7)
    strip(q, r), strip(r, 1)
    z = np.array(points)
    return np.column_stack([z.real, z.imag]), np.array(triangles)


@pytest.mark.parametrize("seed", range(3))
def test_two_holes_that_are_none_by_themselves(seed):
    known = specimen(*strips_about_two_holes(seed), seed=seed)
    found = recover(known.matrix)
    assert not found.certified
    (other,) = found.alternatives
    assert set(other.cells) == triangle_set(found.triangles) - triangle_set(known.triangles)
    assert recover(known.matrix, scale=1.0).certified


def test_a_triangle_that_can_be_none():
    points = np.array([(0, 0), (1, 0), (0.4, 0.9), (0.5, -0.8), (1.2, 0.8), (-0.4, 0.7)])
    known = specimen(points, np.array([(0, 1, 2), (0, 3, 1), (1, 4, 2), (2, 5, 0)]), c=2.0)
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert not found.alternatives


@pytest.mark.parametrize("seed", [9, 15, 23, 25, 31, 34, 35, 39])
def test_few_points_and_many_holes(seed):
    """Scales that lone triangles suggest have candidates of their own; in the seventh two triangles may be holes."""
    rng = np.random.default_rng(seed)
    points, triangles = delaunay(rng.random((int(rng.integers(12, 40)), 2)))
    used, triangles = np.unique(triangles[rng.random(len(triangles)) > 0.4], return_inverse=True)
    known = specimen(points[used], triangles.reshape(-1, 3), seed=seed)
    found = recover(known.matrix)
    assert found.certified == (seed != 35), found.reason
    if found.certified:
        assert triangle_set(found.triangles) == triangle_set(known.triangles)
    else:
        (other,) = found.alternatives
        assert set(other.cells) == triangle_set(found.triangles) - triangle_set(known.triangles)
