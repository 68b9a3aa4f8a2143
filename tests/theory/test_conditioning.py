"""docs/theory.md, sections 6 to 8: conditioning, the polish, the bound behind the certificate."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

from dense_mesh import Mesh, disc, lattice, noise, square


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    """A square with a hole."""
    return square(9, [(0.45 + 0.55j, 0.2)])


def as_real(z: NDArray) -> NDArray:
    """x then y."""
    return np.concatenate([z.real, z.imag])


def as_complex(xy: NDArray) -> NDArray:
    x, y = np.split(xy, 2)
    return x + 1j * y


def without_similarities(mesh: Mesh, d: NDArray) -> NDArray:
    """The part of d (n,) orthogonal to alpha p + beta."""
    q, _ = np.linalg.qr(np.column_stack([np.ones(mesh.n), mesh.p]))
    return d - q @ (q.conj().T @ d)


def rms(d: NDArray) -> float:
    return float(np.linalg.norm(d) / np.sqrt(len(d)))


def rank(matrix: NDArray) -> int:
    singular = np.linalg.svd(matrix, compute_uv=False)
    return int((singular > 1e-10 * singular[0]).sum())


def estimators(mesh: Mesh) -> tuple[NDArray, NDArray]:
    """Linear maps from changes of the weights to displacements (x, y): of the null vector, of the polish."""
    pseudo_inverse = scipy.linalg.pinvh(mesh.energy, rtol=1e-13)
    edges = np.eye(len(mesh.edges[0]))
    null_vector = np.column_stack(
        [as_real(-pseudo_inverse @ (mesh.graph_laplacian(change) @ mesh.p) / 2) for change in edges]
    )
    return null_vector, np.linalg.pinv(mesh.jacobian, rcond=1e-9)


@pytest.mark.parametrize("rings", [5, 10])
def test_least_eigenvalue_on_a_disc(rings):
    """The third eigenvalue of M falls like 1 / v^2, and lies below 6 pi R^2 / v."""
    mesh = disc(rings)
    mean_square = (mesh.areas * mesh.circumradii**2).sum() / mesh.areas.sum()
    least = scipy.linalg.eigvalsh(mesh.energy)[2]
    assert 20 < least * mesh.n**2 < 30
    assert 0.6 < least * mesh.n / (6 * np.pi * mean_square) < 1


def test_derivative_of_the_weights(mesh):
    d = noise(mesh.n)
    step = 1e-6
    difference = (mesh.weights(mesh.p + step * d) - mesh.weights(mesh.p - step * d)) / (2 * step)
    scale = np.abs(difference).max()
    np.testing.assert_allclose(mesh.weight_change(d), difference, atol=1e-7 * scale)
    np.testing.assert_allclose(mesh.jacobian @ as_real(d), mesh.weight_change(d), atol=1e-12 * scale)


def test_jacobian_has_only_the_similarities_in_its_null_space(mesh):
    assert rank(mesh.jacobian) == 2 * mesh.n - 4
    for d in (1, 1j, mesh.p, 1j * mesh.p):
        np.testing.assert_allclose(mesh.weight_change(d * np.ones(mesh.n)), 0, atol=1e-11)


def test_scale_is_not_confounded_with_the_shape(mesh):
    """The weights themselves are no combination of the columns of J."""
    w = mesh.weights(mesh.p)
    assert rank(np.column_stack([mesh.jacobian, w])) == 2 * mesh.n - 3


def test_energy_and_jacobian_are_linked(mesh):
    """M d = -(Laplacian of J d) p / 2."""
    d = noise(mesh.n)
    right = -mesh.graph_laplacian(mesh.weight_change(d)) @ mesh.p / 2
    np.testing.assert_allclose(mesh.energy @ d, right, atol=1e-12 * np.abs(right).max())


def test_null_vector_is_an_unbiased_estimator_and_the_polish_the_better_one(mesh):
    null_vector, polish = estimators(mesh)
    d = without_similarities(mesh, noise(mesh.n))
    response = mesh.weight_change(d)
    for estimator in (null_vector, polish):
        error = without_similarities(mesh, as_complex(estimator @ response) - d)
        assert rms(error) < 1e-9 * rms(d)
    # Gauss and Markov: the difference of the covariances is positive semidefinite, once both gauges agree.
    project = np.column_stack([as_real(without_similarities(mesh, as_complex(u))) for u in np.eye(2 * mesh.n)])
    covariance = [project @ e @ e.T @ project.T for e in (null_vector, polish)]
    excess = scipy.linalg.eigvalsh(covariance[0] - covariance[1])
    assert excess[0] > -1e-10 * excess[-1]
    assert np.trace(covariance[0]) > 1.5 * np.trace(covariance[1])


def test_growth_of_errors_on_irregular_meshes():
    """Independent noise: the null vector's error grows like sqrt(v), the polished one's does not."""
    meshes = [square(k) for k in (7, 14)]
    error = np.array([[np.linalg.norm(e) / np.sqrt(m.n) for e in estimators(m)] for m in meshes])
    root = np.sqrt(meshes[1].n / meshes[0].n)
    assert error[1, 0] / error[0, 0] == pytest.approx(root, rel=0.15)
    assert error[1, 1] / error[0, 1] < 1.25


def test_lattices_are_harder_than_irregular_meshes():
    """Across an edge of a lattice the two changes of the cotangent cancel: the polished error grows too."""
    error = [np.linalg.norm(np.linalg.pinv(lattice(k).jacobian, rcond=1e-9)) / k for k in (7, 14)]
    assert error[1] / error[0] > 1.25


def test_misfit_form_is_at_most_twice_the_sum_over_triangles(mesh):
    """|J d|^2 <= 2 sum q_t, and q_t sees only the anti-conformal part of d."""
    total = np.zeros((2 * mesh.n, 2 * mesh.n))
    for corners, e in zip(mesh.t, mesh.sides, strict=True):
        own = Mesh(mesh.p[corners], np.arange(3)[None]).jacobian
        # beta is a multiple of e'd; where it vanishes, so does q_t.
        conformal = np.block([[e.real, -e.imag], [e.imag, e.real]])
        assert np.abs(own @ scipy.linalg.null_space(conformal)).max() < 1e-10 * np.abs(own).max()
        both = np.concatenate([corners, mesh.n + corners])
        total[np.ix_(both, both)] += own.T @ own
    slack = scipy.linalg.eigvalsh(2 * total - mesh.jacobian.T @ mesh.jacobian)
    assert slack[0] > -1e-10 * slack[-1]


def test_chord_iteration_contracts_by_the_distance_from_the_mesh(mesh):
    """One factorisation at a start that is off by d leaves d^2 after a step and d^3 after two."""
    target = mesh.weights(mesh.p)
    for size in (1e-3, 1e-4):
        start = Mesh(mesh.p + size / 9 * noise(mesh.n), mesh.t)
        inverse = np.linalg.pinv(start.jacobian, rcond=1e-9)
        z = start.p
        errors = []
        for _ in range(3):
            fit = without_similarities(Mesh(z, mesh.t), mesh.p)  # what a similarity of z cannot explain
            errors.append(rms(fit))
            z = z + as_complex(inverse @ (target - mesh.weights(z)))
        assert errors[1] < 60 * size * errors[0]
        assert errors[2] < 60 * size * errors[1]


@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-6])
def test_certificate_bounds_the_error(mesh, size):
    """A mesh whose weights are off by r is within |R p| / (2 mu - |R|) of the true one, modulo similarity."""
    found = Mesh(mesh.p + size * noise(mesh.n), mesh.t)
    difference = mesh.graph_laplacian(mesh.weights(mesh.p) - found.weights(found.p))
    mu = scipy.linalg.eigvalsh(found.energy)[2]
    norm = np.linalg.norm(difference, 2)
    assert norm < mu
    # The true mesh as alpha found + beta + d, measured in the frame in which alpha = 1.
    basis = np.column_stack([np.ones(mesh.n), found.p])
    (_, alpha), *_ = np.linalg.lstsq(basis, mesh.p, rcond=None)
    d = without_similarities(found, mesh.p / alpha)
    bound = np.linalg.norm(difference @ found.p) / (2 * mu - norm)
    assert np.linalg.norm(d) <= bound
    # Pessimistic: it allows for the worst distribution of the misfit over the edges.
    assert bound < 1e3 * np.linalg.norm(d)
