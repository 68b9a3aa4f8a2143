"""The convex program by itself."""

import numpy as np
import pytest
from scipy.optimize import check_grad
from surfaces import moebius, sphere, torus

from meshes import edge_list
from unassemble.errors import GeometryError
from unassemble.metric import angles, areas_cotangents, heron, longest_step, solve_metric


def with_lengths(points, triangles):
    edges = edge_list(triangles)
    n = len(points)
    ends = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2) @ [n, 1]
    opposite = np.searchsorted(edges @ [n, 1], ends)
    return opposite, ((points[edges[:, 0]] - points[edges[:, 1]]) ** 2).sum(axis=1)


def weights_of(opposite, squared):
    return np.bincount(opposite.ravel(), areas_cotangents(squared[opposite])[1].ravel() / 2)


def test_weights_are_the_gradient_of_twice_the_area():
    opposite, squared = with_lengths(*torus())

    def area(u):
        return 2 * areas_cotangents(u[opposite])[0].sum()

    wrong = check_grad(area, lambda u: weights_of(opposite, u), squared)
    assert wrong <= 1e-5 * np.linalg.norm(weights_of(opposite, squared))


def test_area_is_concave():
    opposite, one = with_lengths(*torus(seed=1))
    _, two = with_lengths(*torus(seed=2))

    def area(u):
        return areas_cotangents(u[opposite])[0].sum()

    assert area((one + two) / 2) > (area(one) + area(two)) / 2


@pytest.mark.parametrize("mesh", [torus, moebius, lambda: sphere(300)])
def test_lengths_and_scale_are_right_to_rounding(mesh):
    opposite, squared = with_lengths(*mesh())
    found = solve_metric(2.5 * weights_of(opposite, squared), opposite)
    assert found.scale == pytest.approx(2.5, rel=1e-12)
    np.testing.assert_allclose(found.squared / squared, (found.squared / squared)[0], rtol=1e-10)


def test_without_the_polish_a_few_digits_are_right():
    opposite, squared = with_lengths(*torus())
    found = solve_metric(weights_of(opposite, squared), opposite, polish=False)
    ratio = found.squared / squared
    assert 1e-12 < ratio.max() / ratio.min() - 1 < 1e-3


def test_negative_sum_has_no_metric():
    opposite, _ = with_lengths(*torus())
    with pytest.raises(GeometryError):
        solve_metric(-np.ones(opposite.max() + 1), opposite)


def test_triangles_by_their_sides():
    sides = np.array([[9.0, 16.0, 25.0], [3.0, 3.0, 3.0], [1.0, 1.0, 5.0]])
    assert heron(sides)[0] == 16 * 36
    assert heron(sides)[2] < 0
    np.testing.assert_allclose(angles(sides[:2]).sum(axis=1), np.pi)
    np.testing.assert_allclose(angles(sides[:1])[0, 2], np.pi / 2)
    step = longest_step(sides[1:2], np.array([[0.0, 0.0, 1.0]]))
    assert heron(sides[1:2] + step * np.array([[0.0, 0.0, 1.0]]))[0] == pytest.approx(0, abs=1e-9)
    near = np.random.default_rng(0).uniform(1, 1.4, size=(99, 3))
    np.testing.assert_allclose(longest_step(near, -2 * near), 0.5)  # a point
