"""Section 3.3's square system, by GMRES, BiCG, BiCGSTAB and QMR, with and without matched rows."""

import numpy as np
import pytest

from unassemble_paper.meshes import square
from unassemble_paper.square_systems import METHODS, newton_by_lu, paired, picked, solved_by, square_table


@pytest.fixture(scope="module")
def grid(assemble):
    return assemble(square(6), seed=0)


def test_it_lacks_rank_at_the_start_by_the_interior_vertices(grid):
    system = grid.system()
    matrix, rhs = picked(system, system.pack(np.full_like(grid.angles, np.pi / 3)))
    assert matrix.shape == (system.n_unknowns,) * 2
    values = np.linalg.svd(matrix.toarray(), compute_uv=False)
    assert (values < 1e-9 * values[0]).sum() == grid.corners.counts.w
    assert len(rhs) == len(values)


def test_beside_the_mesh_lu_and_gmres_solve_it_and_bicg_does_not(grid):
    system = grid.system()
    errors = np.random.default_rng(0).standard_normal(grid.angles.size)
    x = system.pack(grid.angles + 1e-3 * errors)
    assert newton_by_lu(system, x) < 1e-6
    matrix, rhs = picked(system, x)
    products, residual = solved_by("gmres", matrix, rhs)
    assert residual < 1e-6
    assert products > 0.8 * len(rhs)
    for method in ("bicg", "bicgstab", "qmr"):
        assert solved_by(method, matrix, rhs)[1] > 1e-4


def test_matched_rows_have_a_full_diagonal_and_the_same_solution(grid):
    system = grid.system()
    errors = np.random.default_rng(0).standard_normal(grid.angles.size)
    matrix, rhs = picked(system, system.pack(grid.angles + 0.1 * errors))
    moved, right = paired(matrix, rhs)
    assert (matrix.diagonal() == 0).any()
    assert (moved.diagonal() != 0).all()
    dense = np.linalg.solve(matrix.toarray(), rhs)
    np.testing.assert_allclose(
        np.linalg.solve(moved.toarray(), right), dense, rtol=1e-6, atol=1e-8 * np.abs(dense).max()
    )


def test_the_table_has_every_method_three_points_and_both_orders(grid):
    made = square_table([grid])
    assert made.columns[-4:] == tuple(METHODS)
    assert len(made.rows) == 6
    assert [row[3] for row in made.rows] == [grid.corners.counts.w] * 2 + [0] * 4
