"""Surfaces whose coefficient may vary: with one of its own in each triangle nearly any entries are a surface's."""

import numpy as np
import pytest
import scipy.sparse as sp
from surfaces import largest_error, sphere, surface, torus

from unassemble import recover

ASSUMED = "that the coefficient is constant is assumed"


def warned(found):
    return any(ASSUMED in warning for warning in found.warnings)


def areas(points, triangles):
    a, b, c = points[triangles].transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def lumped_mass(points, triangles):
    return np.bincount(triangles.ravel(), np.repeat(areas(points, triangles) / 3, 3), len(points))


def with_coefficients(points, triangles, coefficient, diagonal=None, seed=0):
    """The stiffness matrix with `coefficient` (m,) in the triangles, by cotangents, rows permuted at random."""
    n = len(points)
    row, column, value = [], [], []
    for k in range(3):
        own, one, other = (triangles[:, (k + step) % 3] for step in range(3))
        u, v = points[one] - points[own], points[other] - points[own]
        weight = coefficient * (u * v).sum(axis=1) / np.linalg.norm(np.cross(u, v), axis=1) / 2
        row += [one, other, one, other]
        column += [other, one, one, other]
        value += [-weight, -weight, weight, weight]
    matrix = sp.csr_array((np.concatenate(value), (np.concatenate(row), np.concatenate(column))), shape=(n, n))
    if diagonal is not None:
        matrix = sp.csr_array(matrix + sp.diags_array(diagonal))
    order = np.random.default_rng(seed).permutation(n)
    return sp.csr_array(matrix[order][:, order]), points[order]


def random_coefficient(triangles, seed=0):
    return np.exp(0.3 * np.random.default_rng(seed).standard_normal(len(triangles)))


@pytest.mark.parametrize("options", [{}, {"operator": "surface"}])
def test_what_the_entries_do_not_show_is_not_said_to_be_proved(options):
    """A constant coefficient gives the lengths, another one other lengths, and neither matrix shows which it has."""
    points, triangles = sphere(90)
    right = recover(*with_coefficients(points, triangles, np.ones(len(triangles)))[:1], **options)
    matrix, shuffled = with_coefficients(points, triangles, random_coefficient(triangles))
    other = recover(matrix, **options)
    assert largest_error(other, shuffled) > 1e-2
    for found in (right, other):
        assert (found.status, found.uniqueness) == ("certified", "searched")
        assert warned(found)


def test_regions_of_two_coefficients_are_not_said_to_be_proved():
    points, triangles = sphere(120, 2)
    coefficient = np.where(points[triangles].mean(axis=1)[:, 0] > 0, 3.0, 1.0)
    found = recover(with_coefficients(points, triangles, coefficient)[0], operator="surface")
    assert found.uniqueness != "proved"
    assert warned(found)


def test_a_scale_that_is_known_tells():
    points, triangles = torus()
    known = surface(points, triangles, c=2.5)
    found = recover(known.matrix, operator="surface", scale=2.5)
    assert (found.status, found.uniqueness) == ("certified", "proved")
    assert not warned(found)
    spoilt = with_coefficients(points, triangles, 2.5 * random_coefficient(triangles))[0]
    assert not recover(spoilt, operator="surface", scale=2.5).certified


def test_a_lumped_mass_matrix_tells():
    points, triangles = torus()
    mass = 0.3 * lumped_mass(points, triangles)
    found = recover(with_coefficients(points, triangles, np.ones(len(triangles)), mass)[0], operator="surface")
    assert (found.status, found.uniqueness) == ("certified", "proved")
    assert not warned(found)
    spoilt = with_coefficients(points, triangles, random_coefficient(triangles), mass)[0]
    assert not recover(spoilt, operator="surface").certified


def flat_torus(k, m, seed=0):
    """Corners of the triangles of a torus without curvature, (t, 3, 2), and their vertices, (t, 3)."""
    rng = np.random.default_rng(seed)
    shaken = np.stack(np.meshgrid(np.arange(k), np.arange(m), indexing="ij"), -1) + rng.uniform(-0.2, 0.2, (k, m, 2))
    i, j = (index.ravel() for index in np.meshgrid(np.arange(k), np.arange(m), indexing="ij"))

    def at(di, dj):
        whole = np.stack([(i + di) // k * k, (j + dj) // m * m], axis=1)
        return shaken[(i + di) % k, (j + dj) % m] + whole, (i + di) % k * m + (j + dj) % m

    corners = [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]]
    places = np.concatenate([np.stack([place for place, _ in one], axis=1) for one in corners])
    return places, np.concatenate([np.stack([vertex for _, vertex in one], axis=1) for one in corners])


def test_vertices_that_are_all_flat_tell():
    places, triangles = flat_torus(7, 8)
    u, v = places[:, 1:].transpose(1, 0, 2) - places[:, 0]
    gradient = np.stack([v - u, -v, u], axis=1)  # turned by a right angle, times twice the area
    local = (
        np.einsum("tia,tja->tij", gradient, gradient)
        / (2 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]))[:, None, None]
    )
    row, column = np.repeat(triangles, 3, axis=1).ravel(), np.tile(triangles, (1, 3)).ravel()
    for coefficient in (np.ones(len(triangles)), random_coefficient(triangles)):
        entries = (coefficient[:, None, None] * local).ravel()
        found = recover(sp.csr_array((entries, (row, column)), shape=(56, 56)))
        constant = np.ptp(coefficient) == 0
        assert found.certified, found.reason
        assert found.uniqueness == ("proved" if constant else "searched")
        assert warned(found) != constant


def test_a_torus_in_space_is_not_flat():
    found = recover(surface(*torus()).matrix)
    assert (found.status, found.uniqueness) == ("certified", "searched")
    assert warned(found)
