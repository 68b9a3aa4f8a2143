"""Newton, the inner-outer iteration, forcing terms, and every failure status."""

import numpy as np
import pytest

from unassemble.errors import InputError
from unassemble.paper import (
    AngleSystem,
    NewtonOptions,
    Picked,
    bicg,
    cgls,
    eisenstat_walker,
    forcing,
    lsqr,
    solve,
    square_rows,
)
from unassemble_paper.meshes import square


class Dense:
    """A dense matrix as a linear map."""

    def __init__(self, matrix):
        self.matrix, self.shape = matrix, matrix.shape

    def forward(self, step):
        return self.matrix @ step

    def adjoint(self, residual):
        return self.matrix.T @ residual


@pytest.mark.parametrize("method", [cgls, lsqr])
def test_least_squares_methods_against_numpy(method):
    rng = np.random.default_rng(0)
    matrix, rhs = rng.standard_normal((30, 12)), rng.standard_normal(30)
    result = method(Dense(matrix), rhs, tolerance=1e-12, max_steps=200)
    assert result.converged
    assert result.steps <= 20
    np.testing.assert_allclose(result.step, np.linalg.lstsq(matrix, rhs)[0], atol=1e-9)
    cut = method(Dense(matrix), rhs, tolerance=1e-12, max_steps=3)
    assert not cut.converged
    assert cut.steps == 3


def test_cgls_and_lsqr_have_the_same_iterates():
    rng = np.random.default_rng(1)
    matrix, rhs = rng.standard_normal((20, 20)), rng.standard_normal(20)
    one, two = (m(Dense(matrix), rhs, tolerance=1e-14, max_steps=6).step for m in (cgls, lsqr))
    np.testing.assert_allclose(one, two, atol=1e-10)


@pytest.mark.parametrize("method", [cgls, lsqr, bicg])
def test_zero_right_hand_side(method):
    result = method(Dense(np.eye(3)), np.zeros(3), tolerance=1e-8, max_steps=10)
    assert result.converged
    assert result.steps == 0
    assert not result.step.any()


def test_bicg_solves_square_systems_and_reports_breakdown():
    rng = np.random.default_rng(2)
    matrix, rhs = np.eye(15) + 0.1 * rng.standard_normal((15, 15)), rng.standard_normal(15)
    result = bicg(Dense(matrix), rhs, tolerance=1e-10, max_steps=100)
    assert result.converged
    np.testing.assert_allclose(matrix @ result.step, rhs, atol=1e-8)
    broken = bicg(Dense(np.array([[0.0, 1.0], [-1.0, 0.0]])), np.array([1.0, 0.0]), tolerance=1e-10, max_steps=10)
    assert not broken.converged


def test_picked_rows_are_rows():
    matrix = np.arange(12.0).reshape(4, 3)
    picked = Picked(Dense(matrix), square_rows(matrix.shape, 1, 3))
    np.testing.assert_array_equal(picked.rows, [0, 1, 3])
    np.testing.assert_array_equal(picked.forward(np.ones(3)), matrix[[0, 1, 3]] @ np.ones(3))
    np.testing.assert_array_equal(picked.adjoint(np.ones(3)), matrix[[0, 1, 3]].T @ np.ones(3))
    with pytest.raises(InputError, match="least-squares"):
        square_rows((3, 4), 0, 2)


def test_forcing_terms():
    assert [forcing("2^-i")([1.0] * i, 0) for i in (1, 2, 3)] == [0.5, 0.25, 0.125]
    assert forcing("1.1^-i")([1.0, 1.0], 0) == pytest.approx(1.1**-2)
    assert forcing("newton")([1.0], 0) == 1e-10
    assert eisenstat_walker([1.0], 0.5) == 0.5
    assert eisenstat_walker([1.0, 0.1], 0.2) == pytest.approx(0.009)
    assert eisenstat_walker([1.0, 0.1], 0.8) == pytest.approx(0.9 * 0.64)  # the safeguard
    assert eisenstat_walker([1.0, 2.0], 0.5) == 0.9
    with pytest.raises(InputError, match="3\\^-i"):
        forcing("3^-i")


@pytest.mark.parametrize("inner", ["cgls", "lsqr"])
@pytest.mark.parametrize("rule", ["newton", "2^-i", "1.1^-i", "eisenstat-walker"])
@pytest.mark.parametrize("unknowns", ["cotangents", "angles"])
def test_with_sine_products_everything_converges(paper_case, inner, rule, unknowns):
    """The paper's meshes, c unknown, from pi/3, for every forcing, both unknowns, both least-squares methods."""
    system = AngleSystem(paper_case.corners, paper_case.weights, unknowns, scale_free=True, sines=True)
    options = NewtonOptions(rule, inner, tolerance=1e-8)
    result = solve(system, system.pack(np.full_like(paper_case.angles, np.pi / 3)), options)
    assert result.converged
    assert result.status.startswith("converged")
    assert result.history.residuals[-1] <= 1e-8
    assert np.abs(system.angles(result.x) - paper_case.angles).max() < 1e-7
    assert abs(system.factor(result.x) - 1) < 1e-7
    limit = 8_000 if rule == "newton" else 2_000
    assert result.products < limit


@pytest.mark.parametrize("scale_free", [False, True])
@pytest.mark.parametrize("inner", ["cgls", "lsqr"])
def test_the_papers_own_iteration_reaches_1e_6(paper_case, scale_free, inner):
    """Forcing 1.1^-i on (1)-(4) alone: three orders soon, then slowly; the angles have a thousandth of the digits."""
    system = AngleSystem(paper_case.corners, paper_case.weights, scale_free=scale_free)
    result = solve(
        system,
        system.pack(np.full_like(paper_case.angles, np.pi / 3)),
        NewtonOptions("1.1^-i", inner, max_products=80_000),
    )
    assert result.converged
    assert result.history.steps_to(1e-3) <= 125
    assert np.abs(system.angles(result.x) - paper_case.angles).max() < 5e-3


def test_newton_fails_on_the_unstructured_meshes(paper_case):
    system = AngleSystem(paper_case.corners, paper_case.weights, scale_free=True)
    result = solve(
        system, system.pack(np.full_like(paper_case.angles, np.pi / 3)), NewtonOptions("newton", max_products=30_000)
    )
    if paper_case.name == "square":
        assert result.converged
        assert len(result.history.residuals) - 1 == 4
        assert 300 <= result.history.inner_steps[-1] <= 450
    else:
        assert not result.converged
        assert result.status.startswith("stopped")
        assert result.history.residuals.min() > 1


def test_bicg_on_picked_equations_solves_the_tiniest_grid_only(assemble, paper_case):
    tiny = assemble(square(3), seed=0)
    system = AngleSystem(tiny.corners, tiny.weights, scale_free=True)
    start = system.pack(tiny.angles + 1e-2 * np.random.default_rng(0).standard_normal(tiny.angles.size))
    solved = solve(system, start, NewtonOptions("newton", "bicg", tolerance=1e-6, max_inner=500))
    assert solved.converged
    hard = AngleSystem(paper_case.corners, paper_case.weights, scale_free=paper_case.name != "rocket")
    options = NewtonOptions("1.1^-i", "bicg", max_products=3_000)
    stuck = solve(hard, hard.pack(np.full_like(paper_case.angles, np.pi / 3)), options)
    assert not stuck.converged
    assert stuck.status.split(":")[0] in {"stopped", "diverged", "broke down"}


def test_bicg_needs_a_square_system(paper_case):
    system = AngleSystem(paper_case.corners, paper_case.weights, scale_free=True)
    if paper_case.name != "rocket":
        pytest.skip("square")
    with pytest.raises(InputError, match="1788 equations for 1789 unknowns"):
        solve(system, system.pack(paper_case.angles), NewtonOptions(inner="bicg"))


def test_statuses(paper_case):
    system = AngleSystem(paper_case.corners, paper_case.weights)
    start = system.pack(np.full_like(paper_case.angles, np.pi / 3))
    stopped = solve(system, start, NewtonOptions(max_outer=2))
    assert stopped.status.startswith("stopped")
    assert "2 outer steps" in stopped.status
    spent = solve(system, start, NewtonOptions(max_products=10))
    assert "products, the most allowed" in spent.status
    assert 10 <= spent.products <= 14
    diverged = solve(system, start, NewtonOptions(divergence=1e-9))
    assert diverged.status.startswith("diverged")
    wrong = AngleSystem(paper_case.corners, np.full_like(paper_case.weights, np.nan))
    assert solve(wrong, start).status.startswith("diverged")


def test_wrong_matrices_do_not_converge(paper_case):
    """Entries of no mesh: the residual stays, and the status says so."""
    rng = np.random.default_rng(5)
    system = AngleSystem(
        paper_case.corners, paper_case.weights * rng.uniform(0.5, 2, paper_case.weights.size), sines=True
    )
    result = solve(
        system, system.pack(np.full_like(paper_case.angles, np.pi / 3)), NewtonOptions(max_products=3_000, damped=True)
    )
    assert not result.converged
    assert result.history.residuals.min() > 1e-2


def test_damping_never_lets_the_residual_grow(paper_case):
    system = AngleSystem(paper_case.corners, paper_case.weights)
    options = NewtonOptions("newton", damped=True, max_products=20_000)
    result = solve(system, system.pack(np.full_like(paper_case.angles, np.pi / 3)), options)
    assert (np.diff(result.history.residuals) <= 1e-9 * result.history.residuals[0]).all()


@pytest.mark.parametrize(
    "wrong", [{"forcing": "fast"}, {"inner": "gmres"}, {"tolerance": 0.0}, {"max_outer": 0}, {"max_products": 0}]
)
def test_options_are_checked_when_made(wrong):
    with pytest.raises(InputError):
        NewtonOptions(**wrong)


def test_runs_are_deterministic(paper_case):
    system = AngleSystem(paper_case.corners, paper_case.weights, sines=True)
    start = system.pack(np.full_like(paper_case.angles, np.pi / 3))
    one, two = solve(system, start), solve(system, start)
    np.testing.assert_array_equal(one.x, two.x)
    np.testing.assert_array_equal(one.history.residuals, two.history.residuals)
