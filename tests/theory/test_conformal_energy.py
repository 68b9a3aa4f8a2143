"""docs/theory.md, sections 1 to 5: identities, uniqueness, the scale as an extreme quotient, the sign law.

Nothing of the library is used: the theory stands by itself, and the code is tested elsewhere.
"""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

from dense_mesh import Mesh, area_matrix, disc, noise, square

HOLES = ((0.3 + 0.3j, 0.13), (0.7 + 0.65j, 0.16))


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    """A square with two holes."""
    mesh = square(12, HOLES)
    assert len(mesh.loops) == 3
    assert mesh.n - len(mesh.edges[0]) + len(mesh.t) == 1 - 2
    return mesh


def form(matrix: NDArray, z: NDArray) -> float:
    """z* matrix z."""
    value = z.conj() @ matrix @ z
    assert abs(value.imag) < 1e-12 * max(1, abs(value))
    return float(value.real)


def second_differences(mesh: Mesh, z: NDArray) -> NDArray:
    """z[p0, p1, p2] on each triangle."""
    q, values = mesh.p[mesh.t], z[mesh.t]
    return sum(values[:, k] / ((q[:, k] - q[:, k - 2]) * (q[:, k] - q[:, k - 1])) for k in range(3))


def quotients(mesh: Mesh, area: NDArray) -> NDArray:
    """Finite stationary quotients E / a modulo constants, 1 / mu for mu increasing."""
    mu = scipy.linalg.eigvalsh(area[1:, 1:], mesh.stiffness[1:, 1:] / 2)
    return 1 / mu[np.abs(mu) > 1e-9]


def test_entries_are_cotangents(mesh):
    i, j = mesh.edges[0].T
    np.testing.assert_allclose(-mesh.stiffness[i, j], mesh.weights(mesh.p), atol=1e-13)
    np.testing.assert_allclose(mesh.stiffness.sum(axis=1), 0, atol=1e-13)


def test_cotangents_of_a_triangle(mesh):
    """Halved cotangents g of one triangle satisfy g1 g2 + g2 g3 + g3 g1 = 1/4."""
    g = np.array([Mesh(mesh.p[t], np.arange(3)[None]).weights(mesh.p[t]) for t in mesh.t])
    np.testing.assert_allclose(g[:, 0] * g[:, 1] + g[:, 1] * g[:, 2] + g[:, 2] * g[:, 0], 0.25, rtol=1e-12)


def test_coordinates_meet_the_boundary_identities(mesh):
    x, y = mesh.p.real, mesh.p.imag
    expected = np.zeros((2, mesh.n))
    for a, b in mesh.boundary:  # b comes after a, and a before b
        expected[:, a] += y[b] / 2, -x[b] / 2
        expected[:, b] -= y[a] / 2, -x[a] / 2
    np.testing.assert_allclose([mesh.stiffness @ x, mesh.stiffness @ y], expected, atol=1e-14)
    np.testing.assert_allclose(mesh.stiffness @ mesh.p / 2, mesh.area_matrix @ mesh.p, atol=1e-14)


def test_area_form_is_the_area(mesh):
    assert form(mesh.area_matrix, mesh.p) == pytest.approx(mesh.areas.sum(), rel=1e-13)


def test_energy_is_a_sum_of_rank_one_terms(mesh):
    total = np.zeros((mesh.n, mesh.n), complex)
    for corners, e, area in zip(mesh.t, mesh.sides, mesh.areas, strict=True):
        total[np.ix_(corners, corners)] += np.outer(e.conj(), e) / (8 * area)
    np.testing.assert_allclose(mesh.energy, total, atol=1e-13)


def test_energy_weighs_second_differences(mesh):
    z = noise(mesh.n)
    squares = 2 * mesh.areas * mesh.circumradii**2 * np.abs(second_differences(mesh, z)) ** 2
    assert form(mesh.energy, z) == pytest.approx(squares.sum(), rel=1e-12)


def test_null_space_is_the_similarities(mesh):
    eigenvalues = scipy.linalg.eigvalsh(mesh.energy)
    assert np.abs(eigenvalues[:2]).max() < 1e-13
    assert eigenvalues[2] > 1e-5
    np.testing.assert_allclose(mesh.energy @ np.column_stack([np.ones(mesh.n), mesh.p]), 0, atol=1e-14)


def test_quotients_lie_beyond_plus_and_minus_one(mesh):
    quotient = quotients(mesh, mesh.area_matrix)
    np.testing.assert_allclose([quotient[0], quotient[-1]], [-1, 1], rtol=1e-12)
    assert (np.abs(quotient[1:-1]) > 1 + 1e-4).all()
    np.testing.assert_allclose(quotient, -quotient[::-1], rtol=1e-9)


def test_finite_quotients_are_counted_by_the_loops(mesh):
    rank = sum(len(loop) - 2 + len(loop) % 2 for loop in mesh.loops)
    assert len(quotients(mesh, mesh.area_matrix)) == rank == np.linalg.matrix_rank(mesh.area_matrix)


def test_mirror_image_has_the_opposite_quotient(mesh):
    z = noise(mesh.n)
    assert form(mesh.area_matrix, z.conj()) == pytest.approx(-form(mesh.area_matrix, z))
    assert form(mesh.stiffness, z.conj()) == pytest.approx(form(mesh.stiffness, z))
    np.testing.assert_allclose(mesh.stiffness @ mesh.p.conj() / 2, -mesh.area_matrix @ mesh.p.conj(), atol=1e-14)


@pytest.mark.parametrize("shift", [0.0, 0.7, 0.999, -0.999])
def test_shifted_energy_is_definite_modulo_constants(mesh, shift):
    eigenvalues = scipy.linalg.eigvalsh(mesh.stiffness / 2 - shift * mesh.area_matrix)
    floor = (1 - abs(shift)) * scipy.linalg.eigvalsh(mesh.stiffness / 2)
    assert (eigenvalues >= floor - 1e-13).all()
    assert floor[1] > 1e-6


@pytest.mark.parametrize(
    ("g", "second_derivative"),
    [
        (lambda p: p**2, lambda p: 2.0 + 0 * p),
        (lambda p: np.exp(2 * p), lambda p: 4 * np.exp(2 * p)),
        (lambda p: 1 / (p - HOLES[1][0]), lambda p: 2 / (p - HOLES[1][0]) ** 3),
    ],
    ids=["square", "exponential", "pole in a hole"],
)
def test_excess_of_holomorphic_maps(mesh, g, second_derivative):
    """E - a is at most half the sum over triangles of R^2 area max |g''|^2, with equality for squares."""
    excess = form(mesh.energy, g(mesh.p))
    # |g''| is greatest on the sides (maximum principle); their points at distance 1/400 are enough here.
    q = mesh.p[mesh.t]
    along = np.linspace(0, 1, 400)[:, None, None]
    greatest = np.abs(second_derivative(q + along * (np.roll(q, 1, axis=1) - q))).max(axis=(0, 2))
    limit = (mesh.areas * (mesh.circumradii * greatest) ** 2).sum() / 2
    assert 0 < excess <= limit * (1 + 1e-12)
    if g(2.0) == 4.0:
        assert excess == pytest.approx(limit, rel=1e-12)


@pytest.mark.parametrize("rings", [6, 12])
def test_cluster_on_a_disc(rings):
    """Quotients are near 1 + k (k - 1) R^2 / 2, R^2 the mean squared circumradius, for the maps p^k."""
    mesh = disc(rings)
    mean_square = (mesh.areas * mesh.circumradii**2).sum() / mesh.areas.sum()
    excess = quotients(mesh, mesh.area_matrix)[-4:][::-1] - 1
    np.testing.assert_allclose(excess, np.array([0, 1, 3, 6]) * mean_square, rtol=0.02, atol=1e-12)


# The sign law


def test_filling_a_hole_makes_the_energy_indefinite(mesh):
    """At the true mesh the form is minus the area of the hole."""
    z = mesh.p
    for loop in mesh.loops:
        a, b = z[loop].T
        if (area := (a.conj() * b).imag.sum() / 2) > 0:
            continue  # the outer loop
        too_full = mesh.energy - area_matrix(mesh.n, loop[:, ::-1])
        assert form(too_full, z) == pytest.approx(area)
        assert scipy.linalg.eigvalsh(too_full)[0] < 0
        assert quotients(mesh, mesh.area_matrix + area_matrix(mesh.n, loop[:, ::-1]))[-1] < 1 - 1e-6


@pytest.mark.parametrize("emptied", [[0], [5, 50, 100]])
def test_emptying_a_cell_leaves_only_constants(mesh, emptied):
    t = mesh.t[emptied]
    cells = area_matrix(mesh.n, np.vstack([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]))
    eigenvalues = scipy.linalg.eigvalsh(mesh.energy + cells)
    assert abs(eigenvalues[0]) < 1e-13
    assert eigenvalues[1] > 1e-6
    assert quotients(mesh, mesh.area_matrix - cells)[-1] > 1 + 1e-6


def test_complementary_labelling_gives_the_mirror_image(mesh):
    """Faces of the sphere: T of all of them, the unbounded one included, adds up to zero."""
    others = sum(area_matrix(mesh.n, loop[:, ::-1]) for loop in mesh.loops)
    np.testing.assert_array_equal(others, -mesh.area_matrix)
    np.testing.assert_allclose((mesh.stiffness / 2 - others) @ mesh.p.conj(), 0, atol=1e-14)
