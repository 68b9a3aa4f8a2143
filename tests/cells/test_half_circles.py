"""Undivided cells whose longest side lies on the boundary and is the diameter of their circle."""

import numpy as np
import pytest

from meshes import delaunay, largest_error, specimen
from unassemble import recover
from vanishing import forgotten


def half_polygons(corners: int, count: int, seed: int):
    """Some in a row along the lower boundary, arbitrary triangles above."""
    rng = np.random.default_rng(seed)
    foot = np.column_stack([np.arange(-1, 2 * count, 2.0), np.zeros(count + 1)])
    middle = 2.0 * np.arange(count)[:, None]
    angle = np.linspace(0, np.pi, corners)[1:-1]
    head = np.stack([middle + np.cos(angle), np.broadcast_to(np.sin(angle), (count, corners - 2))], axis=-1)
    x, y = np.meshgrid(np.arange(-1, 2 * count), np.arange(1.7, 6, 0.9))
    above = np.column_stack([x.ravel(), y.ravel()]) + rng.uniform(-0.25, 0.25, (x.size, 2))
    return delaunay(np.concatenate([foot, head.reshape(-1, 2), above]), longest=2.5)


@pytest.mark.parametrize(("corners", "count", "seed"), [(4, 1, 0), (4, 3, 1), (4, 6, 2), (5, 4, 1)])
def test_half_polygons_on_the_boundary(corners, count, seed):
    known = forgotten(specimen(*half_polygons(corners, count, seed), c=-2.5, seed=seed))
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert np.diff(found.polygons_offsets).tolist() == [corners] * count
    assert largest_error(found.points, known.points) <= 1e-11


def test_a_half_circle_and_a_right_angle_on_its_diameter_are_one_cell():
    """Five corners on a circle, two of them opposite: however the cell is put together, it is written as one."""
    rng = np.random.default_rng(4)
    angle = np.pi * np.array([0, 0.3, 0.65, 1, 1.4])
    inner = np.column_stack([np.cos(angle), np.sin(angle)])
    around = 2 * np.pi * (np.arange(9) + rng.uniform(-0.2, 0.2, 9)) / 9
    rings = [r * np.column_stack([np.cos(around + s), np.sin(around + s)]) for r, s in ((1.7, 0), (2.6, 0.3))]
    known = forgotten(specimen(*delaunay(np.concatenate([inner, *rings])), c=3.0, seed=1))
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert np.diff(found.polygons_offsets).tolist() == [5]
    assert largest_error(found.points, known.points) <= 1e-11
