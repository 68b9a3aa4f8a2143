"""Every element, structured and perturbed, homogeneous and not: coordinates to rounding."""

from dataclasses import replace

import numpy as np
import pytest
from assembled import (
    ELEMENTS,
    box,
    eliminated,
    error,
    heterogeneous,
    on_plane,
    permuted_nodes,
    recover_elasticity,
    stiffness,
)
from supported import with_zeros

TOLERANCE = 1e-8
COUNTS = {
    "tri-p1": (8, 9),
    "tri-p2": (6, 7),
    "quad-q1": (8, 9),
    "quad-s2": (6, 7),
    "quad-q2": (6, 7),
    "tet-p1": (5, 6, 7),
    "hex-q1": (5, 6, 7),
}


def varying_ratio(x):
    return 1 + x[1] + x[0] * x[1]


def case(kind, perturb, varying):
    counts = COUNTS.get(kind, (4, 5, 4))
    material = {"lam": heterogeneous, "mu": varying_ratio} if varying else {"lam": 1.5, "mu": 1.0}
    return permuted_nodes(stiffness(kind, box(kind, counts, perturb=perturb), **material), seed=1)


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("perturb", [0.0, 0.2])
@pytest.mark.parametrize("varying", [False, True])
def test_free_body(kind, perturb, varying):
    given = case(kind, perturb, varying)
    found = recover_elasticity(given.matrix, cells=False)
    assert found.certified
    assert not found.node_status.any()
    assert error(found.points, given.points) < TOLERANCE
    assert [one.null_dimension for one in found.evidence] == [given.dim + 1]
    assert found.evidence[0].gap > 1e4 * found.evidence[0].residual
    assert found.backward_error < 1e-11
    if varying:
        assert found.poisson_ratio is None
    else:
        assert found.poisson_ratio == pytest.approx(0.3, abs=1e-10)


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("varying", [False, True])
def test_clamped_body(kind, varying):
    given = case(kind, 0.2, varying)
    given = replace(given, matrix=with_zeros(given.matrix, given.dim, "stored"))
    matrix, nodes = eliminated(given, np.repeat(on_plane(given, 0)[:, None], given.dim, axis=1))
    found = recover_elasticity(matrix, cells=False)
    assert found.certified
    assert len(found.points) == len(nodes)
    assert error(found.points, given.points[nodes]) < TOLERANCE
    # Linear elements lose no node. Nodes of quadratic ones inside the clamped layer of cells touch eliminated nodes
    # only.
    if kind.endswith(("p1", "q1")):
        assert not found.node_status.any()
    else:
        loose = given.points[nodes][found.node_status == 1]
        assert (loose[:, 0] < np.unique(given.points[:, 0]).max() * 0.5).all()


def test_poisson_ratio_near_one_half_loses_no_digits():
    """Stated accuracy: nu = 0.499 costs no digits to speak of on a graded mesh."""
    nu = 0.499
    given = stiffness("hex-q1", box("hex-q1", (7, 7, 7), perturb=0.1, grading=2.0), lam=2 * nu / (1 - 2 * nu), mu=1.0)
    found = recover_elasticity(given.matrix)
    assert found.certified
    assert error(found.points, given.points) < 1e-12
    assert found.poisson_ratio == pytest.approx(nu, abs=1e-12)
