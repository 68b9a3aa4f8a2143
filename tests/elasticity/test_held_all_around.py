"""Homogeneous bodies held on their whole boundary: the identities leave an affine map, or more, and certify nothing."""

import numpy as np
import pytest
from assembled import (
    ELEMENTS,
    Assembled,
    box,
    eliminated,
    permuted_nodes,
    recover_elasticity,
    stiffness,
)

from unassemble.errors import GeometryError
from unassemble.nodes import given_numbering

COUNTS = {"tet-p1": (8, 7, 8), "tet-p2": (6, 6, 6), "hex-q1": (7, 7, 7), "hex-s2": (6, 6, 6), "hex-q2": (5, 6, 5)}
CASES = [(kind, perturb) for kind in ELEMENTS for perturb in (0.0, 0.2)]


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


@pytest.mark.parametrize(("kind", "perturb"), CASES)
def test_homogeneous_bodies_are_not_certified(kind, perturb):
    matrix, truth = held(kind, perturb, lam=1.5)
    assert_not_certified(matrix, truth.shape[1])


@pytest.mark.parametrize("kind", ["quad-q1", "hex-q1"])
def test_reduced_integration_is_not_certified(kind):
    """More than affine functions satisfy the equations: hourglass modes, which no entry feels."""
    d = 3 if kind == "hex-q1" else 2
    centre = np.full((d, 1), 0.5), np.ones(1)
    matrix, _ = held(kind, 0.0, counts=(6, 5, 6)[:d], lam=1.3, quadrature=centre)
    assert_not_certified(matrix, d)


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
