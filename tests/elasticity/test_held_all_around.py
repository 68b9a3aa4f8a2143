"""Homogeneous bodies held on their whole boundary: the identities leave an affine map, which the elements settle."""

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import (
    ELEMENTS,
    Assembled,
    box,
    eliminated,
    error,
    on_plane,
    permuted_nodes,
    recover_elasticity,
    stiffness,
)
from supported import given, judged

from unassemble import recover
from unassemble.errors import GeometryError
from unassemble.nodes import given_numbering

COUNTS = {"tet-p1": (8, 7, 8), "tet-p2": (6, 6, 6), "hex-q1": (7, 7, 7), "hex-s2": (6, 6, 6), "hex-q2": (5, 6, 5)}
# In boxes of equal hexahedra more than affine functions satisfy all scalar equations, r^(i + j + k) for one.
CASES = [(kind, perturb) for kind in ELEMENTS for perturb in (0.0, 0.2) if perturb or not kind.startswith("hex")]


def rim(case: Assembled) -> np.ndarray:
    """(n, d) all unknowns of the boundary of a box."""
    x = case.points
    outside = (np.abs(x - x.min(axis=0)) < 1e-9) | (np.abs(x - x.max(axis=0)) < 1e-9)
    return np.repeat(outside.any(axis=1)[:, None], case.dim, axis=1)


def held(kind, perturb, *, counts=None, seed=1, **material):
    """A box without its boundary, nodes in random order; the matrix and where its nodes are."""
    mesh = box(kind, counts or COUNTS.get(kind, (9, 8)), perturb=perturb, seed=seed)
    case = permuted_nodes(stiffness(kind, mesh, **material), seed)
    matrix, nodes = eliminated(case, rim(case))
    return matrix, case.points[nodes]


def found_with_numbering(matrix, d):
    """Small bodies in space leave few rows by which the search for the numbering could tell; that is not the point."""
    row = np.arange(matrix.shape[0])
    return recover_elasticity(matrix, numbering=given_numbering(matrix, row // d, row % d))


def assert_not_certified(matrix, d):
    """An affine map stays free, or so many fields that no positions are given."""
    try:
        found = found_with_numbering(matrix, d)
    except GeometryError:  # a null space far too large
        return
    assert not found.certified
    assert found.poisson_ratio is None
    assert "affine" in found.reason


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "perturb"), CASES)
def test_elements_tell_the_axes(kind, perturb):
    matrix, truth = held(kind, perturb, lam=1.5)
    d = truth.shape[1]
    found = found_with_numbering(matrix, d)
    assert found.certified
    assert found.backward_error < 1e-11
    assert len(found.evidence) == 1
    assert found.evidence[0].null_dimension >= d * (d + 1)  # of the identities alone
    assert np.isfinite(found.points).all(axis=1).sum() > 0.3 * len(truth)
    assert error(found.points, truth) < 1e-10
    assert found.poisson_ratio == pytest.approx(0.3, abs=1e-9)
    assert found.lame[:, 0] / found.lame[:, 1] == pytest.approx(np.full(found.n_cells, 1.5), abs=1e-6)


@pytest.mark.parametrize("kind", ["tet-p1", "hex-q1"])
def test_clamped_between_rollers(kind):
    """Rollers on all other sides fix two axes and nothing else."""
    case = stiffness(kind, box(kind, (8, 7, 8), perturb=0.2), lam=1.5)
    gone = np.stack([on_plane(case, axis) | on_plane(case, axis, 1.0) for axis in range(3)], axis=1)
    gone |= gone[:, :1]
    matrix, nodes = eliminated(case, gone)
    row = np.flatnonzero(~gone.ravel())
    found = recover_elasticity(matrix, numbering=given_numbering(matrix, np.searchsorted(nodes, row // 3), row % 3))
    assert found.certified
    assert error(found.points, case.points[nodes]) < 1e-10
    assert np.isfinite(found.points).all(axis=1).mean() > 0.4


@pytest.mark.parametrize("kind", ["quad-q1", "hex-q1"])
def test_reduced_integration_is_not_certified(kind):
    """More than affine functions satisfy the equations: hourglass modes, which no entry feels."""
    d = 3 if kind == "hex-q1" else 2
    centre = np.full((d, 1), 0.5), np.ones(1)
    matrix, _ = held(kind, 0.0, counts=(6, 5, 6)[:d], lam=1.3, quadrature=centre)
    assert_not_certified(matrix, d)


@pytest.mark.parametrize("lam", [-0.5, 0.0, 1e4])
@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1", "tet-p1"])
def test_any_material(kind, lam):
    matrix, truth = held(kind, 0.2, lam=lam)
    found = recover_elasticity(-3.0 * matrix)
    assert found.certified
    assert error(found.points, truth) < 1e-10
    assert found.poisson_ratio == pytest.approx(lam / (2 * (lam + 1)), abs=1e-7)


def test_stretched_and_graded_bodies():
    mesh = box("quad-q1", (12, 9), perturb=0.2, grading=2.0, stretch=(30, 1))
    case = permuted_nodes(stiffness("quad-q1", mesh, lam=1.5))
    matrix, nodes = eliminated(case, rim(case))
    found = recover_elasticity(matrix)
    assert found.certified
    assert error(found.points, case.points[nodes]) < 1e-10


def test_charts_of_a_large_body():
    matrix, truth = held("tet-p1", 0.2, counts=(11, 11, 11), lam=1.5)
    found = recover_elasticity(matrix, patch=300)
    assert found.certified
    assert error(found.points, truth) < 1e-10


def test_pieces_of_different_material():
    """Each has axes of its own to settle; one of them is free, and keeps what the identities say."""
    first, one = held("quad-q1", 0.2, lam=1.5)
    second, two = held("quad-q1", 0.2, lam=0.4, mu=2.0, seed=3)
    third = stiffness("quad-q1", box("quad-q1", (5, 6), perturb=0.2), lam=3.0)
    found = recover_elasticity(sp.csr_array(sp.block_diag([first, third.matrix, second])))
    assert found.certified
    assert found.poisson_ratio is None
    for truth in (one, third.points, two):
        piece = np.flatnonzero([len(truth) == (found.component == k).sum() for k in range(3)])
        assert any(error(found.points[found.component == k], truth) < 1e-10 for k in piece)


def test_in_the_report():
    matrix, truth = held("tri-p1", 0.2, lam=1.5)
    found = recover(matrix)
    assert found.certified
    assert error(found.points, truth) < 1e-10
    assert any("affine map" in warning for warning in found.warnings)


def anisotropic(d, seed, share):
    """Isotropic material with a share of any other that has positive energy."""
    rng = np.random.default_rng(seed)
    unit, pairs = np.eye(d), [(a, b) for a in range(d) for b in range(a, d)]
    factor = rng.standard_normal((len(pairs), len(pairs)))
    other = np.zeros((d,) * 4)
    for p, (a, b) in enumerate(pairs):
        for q, (c, e) in enumerate(pairs):
            for i, j in {(a, b), (b, a)}:
                for k, m in {(c, e), (e, c)}:
                    other[i, j, k, m] = (factor @ factor.T)[p, q]
    stiff = np.einsum("ab,ce->abce", unit, unit) + np.einsum("ac,be->abce", unit, unit)
    return stiff + np.einsum("ae,bc->abce", unit, unit) + share * other


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1", "tri-p2", "tet-p1", "hex-q1"])
@pytest.mark.parametrize(("share", "perturb"), [(1.0, 0.2), (1e-6, 0.0)])
def test_other_homogeneous_materials_are_not_certified(kind, share, perturb):
    """Linear fields satisfy the identities inside any homogeneous material; no isotropic one explains the entries."""
    d = 3 if kind.startswith(("tet", "hex")) else 2
    for seed in range(2 if d == 2 else 1):
        matrix, _ = held(kind, perturb, seed=seed, tensor=anisotropic(d, seed, share))
        assert_not_certified(matrix, d)


@pytest.mark.parametrize("which", ["both", "lambda", "mu"])
def test_checkerboards_are_not_certified(which):
    """The boundary terms of their materials vanish by symmetry, as in a homogeneous body."""

    def two(x):
        return 1.0 + (np.floor(8 * x[0] + 1e-9) + np.floor(8 * x[1] + 1e-9)) % 2

    material = {"lam": two if which != "mu" else 1.0, "mu": two if which != "lambda" else 1.0}
    matrix, _ = held("quad-q1", 0.0, counts=(9, 9), **material)
    found = recover_elasticity(matrix)
    assert not found.certified
    assert "affine" in found.reason


@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1", "tri-p2", "quad-s2"])
@pytest.mark.parametrize("perturb", [0.0, 0.2])
def test_several_supports_on_all_sides(kind, perturb):
    counts = (9, 8) if kind in ("tri-p1", "quad-q1") else (7, 7)
    truth = given(stiffness(kind, box(kind, counts, perturb=perturb), lam=1.5), "several", "interleaved", "stored")
    found = recover_elasticity(truth.matrix)
    verdict = judged(found, truth)
    assert found.certified
    assert verdict.error < 1e-8
    assert verdict.missing < 0.4  # next to the clamp, for quadratic elements, and beside penalties
