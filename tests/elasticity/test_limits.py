"""What the matrix does not tell is said, not guessed; and what coordinates are for."""

import time

import numpy as np
import pyamg
import pytest
import scipy.sparse as sp
from assembled import (
    Assembled,
    box,
    eliminated,
    error,
    heterogeneous,
    on_plane,
    orthotropic,
    permuted_nodes,
    recover_elasticity,
    stiffness,
    vector_laplace,
    with_identity,
    with_penalty,
)
from supported import given as held, judged

from unassemble.errors import FormatError, GeometryError, RecoveryError
from unassemble.modes import rigid_body_modes, save_amgcl_coordinates, save_petsc_vec


def test_orthotropic_material_is_a_best_fit():
    given = stiffness("quad-q1", box("quad-q1", (8, 8), perturb=0.2), form=orthotropic)
    found = recover_elasticity(given.matrix)
    assert found.status == "uncertified"
    assert "no exact null vector" in found.reason
    assert found.evidence[0].residual > 1e-6
    assert error(found.points, given.points) < 0.1  # the shape is nearly right all the same


def test_homogeneous_interior_leaves_an_affine_map():
    """With the whole boundary eliminated linear fields satisfy the identities, and no isotropic element fits."""
    given = stiffness("tri-p1", box("tri-p1", (9, 10), perturb=0.2), form=orthotropic)
    rim = on_plane(given, 0) | on_plane(given, 0, 1.0) | on_plane(given, 1) | on_plane(given, 1, 1.0)
    matrix, nodes = eliminated(given, np.repeat(rim[:, None], 2, axis=1))
    found = recover_elasticity(matrix)
    assert found.status == "uncertified"
    assert "affine" in found.reason
    known = np.isfinite(found.points).all(axis=1)
    design = np.column_stack([found.points[known], np.ones(known.sum())])
    _, residual, *_ = np.linalg.lstsq(design, given.points[nodes][known], rcond=None)
    assert residual.max() < 1e-16


def test_vector_laplacian_comes_apart():
    given = stiffness("tet-p1", box("tet-p1", (4, 4, 4)), form=vector_laplace)
    with pytest.raises(GeometryError, match="not coupled"):
        recover_elasticity(given.matrix)


def test_too_few_whole_rows_are_given_up_at_once():
    """Clamps by identity rows between penalties: the refusal does not wait for a search."""
    shape = box("quad-q1", (3, 4), perturb=0.2, seed=80716)
    body = stiffness("quad-q1", shape, lam=heterogeneous, mu=lambda x: 1 + x[1] + x[0] * x[1])
    clamped = np.zeros((len(body.points), 2), dtype=bool)
    clamped[on_plane(body, 0) | on_plane(body, 0, 1.0)] = True
    penalty = np.zeros_like(clamped)
    penalty[on_plane(body, 1), 1] = True
    stiff = Assembled(with_penalty(body, penalty & ~clamped), body.points, body.cells)
    start = time.perf_counter()
    with pytest.raises(RecoveryError):
        recover_elasticity(with_identity(stiff, clamped))
    assert time.perf_counter() - start < 15


def test_charts_agree_with_one_factorisation():
    given = permuted_nodes(stiffness("tet-p1", box("tet-p1", (9, 9, 9), perturb=0.2)))
    for patch in (10_000, 200):
        found = recover_elasticity(given.matrix, patch=patch, cells=False)
        assert found.certified
        assert error(found.points, given.points) < 1e-10


def test_pyamg_bar():
    example = pyamg.gallery.load_example("bar")
    found = recover_elasticity(sp.csr_array(example["A"]))
    truth = example["vertices"]
    if len(truth) != len(found.points):  # the clamped end is not in the matrix
        ends = [np.abs(truth[:, 0] - end) > 1e-9 for end in (truth[:, 0].min(), truth[:, 0].max())]
        truth = min(
            (truth[kept] for kept in ends if kept.sum() == len(found.points)), key=lambda x: error(found.points, x)
        )
    assert found.certified
    assert error(found.points, truth) < 1e-11


def _modes(found):
    return rigid_body_modes(found.points, found.node_of_row, found.direction_of_row)


def test_modes_are_annihilated_and_serve_multigrid():
    given = permuted_nodes(stiffness("hex-q1", box("hex-q1", (25, 6, 6), perturb=0.1, stretch=(5, 1, 1))))
    matrix, nodes = eliminated(given, np.repeat(on_plane(given, 0)[:, None], 3, axis=1))
    row = np.arange(matrix.shape[0])
    found = recover_elasticity(matrix, cells=False)
    free = recover_elasticity(given.matrix, cells=False)
    size = abs(given.matrix).sum(axis=1).max()
    assert np.abs(given.matrix @ _modes(free)).max() < 1e-10 * size
    counts = {}
    rhs = np.random.default_rng(0).standard_normal(len(row))
    true = rigid_body_modes(given.points[nodes], row // 3, row % 3)
    for name, modes in {"true": true, "recovered": _modes(found), "none": None}.items():
        solver = pyamg.smoothed_aggregation_solver(sp.bsr_matrix(matrix, blocksize=(3, 3)), B=modes)
        residuals = []
        solver.solve(rhs, tol=1e-8, accel="cg", residuals=residuals)
        counts[name] = len(residuals) - 1
    assert abs(counts["recovered"] - counts["true"]) <= 1  # rounding may cost or save one
    assert counts["recovered"] < counts["none"]


def test_exports(tmp_path):
    points = np.random.default_rng(0).standard_normal((5, 3))
    save_petsc_vec(tmp_path / "x.bin", points)
    raw = (tmp_path / "x.bin").read_bytes()
    assert np.frombuffer(raw[:8], ">i4").tolist() == [1211214, 15]
    assert np.array_equal(np.frombuffer(raw[8:], ">f8").reshape(5, 3), points)
    save_amgcl_coordinates(tmp_path / "x.mtx", points)
    from scipy.io import mmread

    assert np.array_equal(mmread(tmp_path / "x.mtx"), points)
    points[2] = np.nan
    with pytest.raises(FormatError, match="node 2"):
        save_petsc_vec(tmp_path / "y.bin", points)


def test_fields_that_hardly_any_node_shares():
    """A plate of twelve squares with supports on all sides: all but one or two nodes of a piece are loose."""
    body = permuted_nodes(stiffness("tri-p2", box("tri-p2", (4, 5)), lam=49.0), seed=0)
    case = held(body, "several", "boundary first by component", "stored")
    found = recover_elasticity(case.matrix)
    assert judged(found, case).error < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_elements_without_shear_prove_nothing(seed):
    """Any three vectors that add up to zero are the divergence on some triangle."""
    vectors = np.random.default_rng(seed).uniform(-1, 1, (3, 2))
    field = (vectors - vectors.mean(axis=0)).ravel()
    try:
        found = recover_elasticity(sp.csr_array(np.outer(field, field)))
    except RecoveryError:
        return
    assert found.status == "uncertified", found.reason
