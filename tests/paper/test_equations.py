"""Equations at the exact angles, Jacobians against finite differences, products against the full matrix."""

import numpy as np
import pytest

from unassemble.paper import AngleSystem

OPTIONS = [
    (unknowns, scale_free, loops, sines)
    for unknowns in ("cotangents", "angles")
    for scale_free in (False, True)
    for loops in (False, True)
    for sines in (False, True)
]


def system_of(case, unknowns="cotangents", scale_free=False, loops=False, sines=False):
    outer = int(np.argmax(case.corners.loop_lengths)) if loops else None
    return AngleSystem(case.corners, case.weights, unknowns, scale_free, outer, sines)


@pytest.mark.parametrize("options", OPTIONS)
def test_equations_hold_at_the_exact_angles(paper_case, options):
    system = system_of(paper_case, *options)
    x = system.pack(paper_case.angles)
    assert x.shape == (system.n_unknowns,)
    assert system.residual(x).shape == (system.n_equations,)
    assert np.abs(system.residual(x)).max() < 1e-12


def test_equations_do_not_hold_for_the_wrong_outer_loop(paper_case):
    if paper_case.corners.counts.h == 0:
        pytest.skip("one loop only")
    system = AngleSystem(paper_case.corners, paper_case.weights, outer=int(np.argmin(paper_case.corners.loop_lengths)))
    assert np.abs(system.residual(system.pack(paper_case.angles))).max() == pytest.approx(4 * np.pi)


@pytest.mark.parametrize("options", OPTIONS)
def test_jacobian_against_central_differences(paper_case, options):
    system = system_of(paper_case, *options)
    rng = np.random.default_rng(0)
    x = system.pack(np.clip(paper_case.angles + 0.05 * rng.standard_normal(paper_case.angles.size), 0.1, 3.0), 1.1)
    jacobian = system.jacobian(x)
    for _ in range(3):
        step = rng.standard_normal(system.n_unknowns)
        h = 1e-6
        slope = (system.residual(x + h * step) - system.residual(x - h * step)) / (2 * h)
        np.testing.assert_allclose(jacobian.forward(step), slope, atol=2e-7 * np.abs(slope).max())


@pytest.mark.parametrize("options", OPTIONS)
def test_products_are_those_of_the_full_matrix(paper_case, options):
    system = system_of(paper_case, *options)
    jacobian = system.jacobian(system.pack(paper_case.angles))
    matrix, rng = jacobian.sparse(), np.random.default_rng(1)
    assert matrix.shape == jacobian.shape
    step, residual = rng.standard_normal(matrix.shape[1]), rng.standard_normal(matrix.shape[0])
    np.testing.assert_allclose(jacobian.forward(step), matrix @ step, atol=1e-12)
    np.testing.assert_allclose(jacobian.adjoint(residual), matrix.T @ residual, atol=1e-11)


def test_storage_is_what_section_3_1_says(paper_case):
    for unknowns in ("cotangents", "angles"):
        system = system_of(paper_case, unknowns)
        jacobian = system.jacobian(system.pack(paper_case.angles))
        entries = jacobian.sparse().nnz
        assert jacobian.stored == 3 * paper_case.corners.counts.m
        assert entries <= 9 * paper_case.corners.counts.m
        assert jacobian.stored < entries / 2


def test_every_column_has_at_most_three_entries(paper_case):
    system = system_of(paper_case)
    matrix = system.jacobian(system.pack(paper_case.angles)).sparse().tocsc()
    assert np.diff(matrix.indptr).max() == 3


def test_angles_stay_between_0_and_pi(paper_case):
    rng = np.random.default_rng(2)
    angles = system_of(paper_case, "angles")
    x, t = angles.advance(paper_case.angles, 10 * rng.standard_normal(angles.n_unknowns))
    assert 0 < t < 1
    assert x.min() > 0
    assert x.max() < np.pi
    cotangents = system_of(paper_case, "cotangents")
    x, t = cotangents.advance(cotangents.pack(paper_case.angles), 1e3 * rng.standard_normal(cotangents.n_unknowns))
    assert t == 1
    assert cotangents.angles(x).min() > 0
    assert cotangents.angles(x).max() < np.pi


def test_the_factor_is_the_inverse_of_c(paper_case):
    """For A = 4 L the paper's c is 1/4."""
    system = AngleSystem(paper_case.corners, 4 * paper_case.weights, scale_free=True)
    assert np.abs(system.residual(system.pack(paper_case.angles, 0.25))).max() < 1e-11
    column = system.jacobian(system.pack(paper_case.angles, 0.25)).sparse()[:, [-1]].toarray().ravel()
    np.testing.assert_allclose(column[system.row_of_edges :], -2 * 4 * paper_case.weights)
    assert not column[: system.row_of_edges].any()
