"""A wrong model must not pass for noise: terms that the misfit shows, in matrices that scikit-fem assembled."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pyamg
import pytest
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementTriP1, MeshTri
from skfem.helpers import dot, grad
from skfem.models.poisson import laplace, mass

from unassemble import RecoveryError, recover


@BilinearForm
def varying(u, v, w):
    return (1 + 0.01 * np.sin(2 * w.x[0] + w.x[1])) * dot(grad(u), grad(v))


@BilinearForm
def oscillating(u, v, w):
    return (1 + 1e-3 * np.sin(5 * w.x[0]) * np.cos(4 * w.x[1])) * dot(grad(u), grad(v))


@BilinearForm
def dense_in_the_middle(u, v, w):
    return np.exp(-(w.x[0] ** 2) - w.x[1] ** 2) * u * v


@BilinearForm
def weak_mass(u, v, w):
    return 1e-3 * u * v


def disc(refinements: int = 4) -> Basis:
    """On a disc, vertices moved at random."""
    mesh = MeshTri.init_circle(refinements)
    rng = np.random.default_rng(refinements)
    points = mesh.p + rng.uniform(-0.1, 0.1, mesh.p.shape) / 2**refinements
    return Basis(MeshTri(points, mesh.t), ElementTriP1())


def shuffled(A):
    place = np.random.default_rng(7).permutation(A.shape[0])
    return sp.csr_array(A)[place][:, place]


MATRICES = {
    "K + M": (lambda b: laplace.assemble(b) + mass.assemble(b), "mass matrix"),
    "K + M / 1000": (lambda b: laplace.assemble(b) + weak_mass.assemble(b), "mass matrix"),
    "a density that varies": (lambda b: laplace.assemble(b) + dense_in_the_middle.assemble(b), "mass matrix"),
    "a coefficient that varies": (varying.assemble, "coefficient that varies"),
}


@pytest.mark.parametrize("refinements", [2, 3, pytest.param(4, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", MATRICES)
def test_another_term_is_no_noise(name, refinements):
    """Neither suggested as noise, nor certified with noise that would explain it by its size."""
    assembled, words = MATRICES[name]
    A = shuffled(assembled(disc(refinements)))
    plain = recover(A)
    assert plain.status != "certified" or plain.reaction  # a reading that knows the term may fit
    if plain.status == "certified":
        return
    assert plain.estimated_noise is None
    assert "standard deviation" not in plain.reason
    assert words in plain.reason
    size = np.abs(A - sp.diags_array(A.diagonal())).max()
    for factor in (0.1, 0.3, 1.0, 3.0):
        told = recover(A, noise=factor * plain.backward_error * size)
        assert told.status != "certified" or told.reaction, told.reason


def test_rows_that_add_up_to_zero_have_no_masses():
    """Masses explain more of the misfit than coefficients that are quadratic polynomials, but leave sums."""
    found = recover(shuffled(oscillating.assemble(disc())))
    assert "a coefficient that varies" in found.reason.lower()
    assert "mass" not in found.reason + found.advice


def test_noise_beside_another_term_is_not_certified_either():
    A = shuffled(laplace.assemble(disc()) + mass.assemble(disc()))
    errors = sp.triu(A, 1).tocoo()
    errors.data = 2e-5 * np.random.default_rng(3).standard_normal(errors.nnz)
    found = recover(A + errors + errors.T, noise=1.5e-4)
    assert found.status != "certified" or found.reaction, found.reason


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_noise_itself_is_still_told_and_certified(seed):
    A, sigma = shuffled(laplace.assemble(disc())), 1e-5
    errors = sp.triu(A, 1).tocoo()
    errors.data = sigma * np.random.default_rng(seed).standard_normal(errors.nnz)
    noisy = A + errors + errors.T
    found = recover(noisy)
    assert "noise of standard deviation" in found.reason
    assert found.estimated_noise == pytest.approx(sigma, rel=0.2)
    assert recover(noisy, noise=sigma).certified
    assert recover(noisy, noise=5 * sigma).certified


def test_noise_is_not_suggested_where_all_rows_add_up_to_zero():
    """A coefficient of its own in each cell leaves a misfit without any form; only the row sums tell it from noise."""
    basis = disc()
    factor = 1 + 1e-4 * np.random.default_rng(0).standard_normal(basis.mesh.t.shape[1])

    @BilinearForm
    def rough(u, v, w):
        return factor[:, None] * dot(grad(u), grad(v))

    found = recover(shuffled(rough.assemble(basis)))
    assert found.status == "uncertified"
    assert "standard deviation" not in found.reason
    assert "add up to zero" in found.reason
    assert "coefficient" in found.advice


@pytest.mark.parametrize("wrong", [2.0, -1.0])
@pytest.mark.parametrize(
    "matrix",
    [
        lambda: pyamg.gallery.poisson((12, 12), format="csr"),  # without its boundary
        lambda: laplace.assemble(
            Basis(MeshTri.init_tensor(np.linspace(0, 1, 9), np.linspace(0, 1, 8)), ElementTriP1())
        ),
    ],
)
def test_a_wrong_scale_where_zeros_are_not_stored(matrix, wrong):
    A = shuffled(matrix())
    with suppress(RecoveryError):
        assert recover(A, scale=wrong).status == "uncertified"
    assert recover(A, scale=1.0).certified
