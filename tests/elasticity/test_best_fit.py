"""Bodies without an exact null field, or with too many: the best fit, what it is worth, and what stays free."""

import numpy as np
import pytest
import skfem
from assembled import box, error, permuted_nodes, recover_elasticity, stiffness
from skfem.helpers import ddot, sym_grad, trace

GAUSS = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3)
RULES = {  # one point fewer in each direction than the element needs
    "quad-q1": (np.full((2, 1), 0.5), np.ones(1)),
    "hex-q1": (np.full((3, 1), 0.5), np.ones(1)),
    "quad-q2": (np.stack(np.meshgrid(GAUSS, GAUSS)).reshape(2, -1), np.full(4, 0.25)),
}


def layers(strength):
    """Orthotropic: layers in turn along the last axis, stiffer along the first axis by 0.2 and 1.8 times strength."""

    @skfem.BilinearForm
    def form(u, v, w):
        e, f = sym_grad(u), sym_grad(v)
        stiffer = strength * (1 + 0.8 * np.sign(np.sin(6 * np.pi * w.x[-1])))
        return trace(e) * trace(f) + 2 * ddot(e, f) + stiffer * (e[0, 0] * f[0, 0] + 0.5 * e[1, 1] * f[1, 1])

    return form


@pytest.mark.parametrize(("kind", "counts"), [("tet-p1", (7, 7, 7)), ("hex-q1", (7, 7, 8)), ("quad-q1", (25, 25))])
def test_best_fit_does_not_depend_on_charts(kind, counts):
    given = permuted_nodes(stiffness(kind, box(kind, counts, perturb=0.2), form=layers(0.3)))
    one, several = (recover_elasticity(given.matrix, patch=patch, cells=False) for patch in (10_000, 100))
    for found in (one, several):
        assert found.status == "uncertified"
        assert "no exact null vector" in found.reason
        evidence = found.evidence[0]
        assert f"{evidence.residual:.1e}" in found.reason
        assert f"{evidence.gap:.1e}" in found.reason
        assert 1e-4 < evidence.residual < 0.2 * evidence.gap
        assert evidence.null_dimension == given.dim
        assert error(found.points, given.points) < 0.02
    assert np.abs(one.points - several.points).max() < 1e-6
    assert several.evidence[0].residual == pytest.approx(one.evidence[0].residual, rel=1e-6)


def test_evidence_tells_a_poor_fit():
    given = stiffness("quad-q1", box("quad-q1", (25, 25), perturb=0.2), form=layers(3.0))
    found = recover_elasticity(given.matrix, cells=False)
    assert found.status == "uncertified"
    assert found.evidence[0].residual > 0.5 * found.evidence[0].gap
    assert 0.1 < error(found.points, given.points) < 0.2


@pytest.mark.slow
def test_bodies_too_large_for_one_factorisation_say_so():
    given = stiffness("tet-p1", box("tet-p1", (31, 31, 33), perturb=0.2), form=layers(0.3))
    found = recover_elasticity(given.matrix, cells=False)
    assert found.status == "uncertified"
    assert any("too large for the best fit" in text for text in found.warnings)


def reduced(kind, counts, perturb):
    mesh = box(kind, counts, perturb=perturb)
    return permuted_nodes(stiffness(kind, mesh, lam=1.5, quadrature=RULES[kind]))


@pytest.mark.parametrize(("kind", "counts"), [("quad-q1", (12, 12)), ("hex-q1", (6, 6, 6))])
def test_selective_reduced_integration_is_exact(kind, counts):
    """The terms of lambda by another rule than those of mu: p and q are other numbers, and that is all."""
    mesh = box(kind, counts, perturb=0.2)
    volume = stiffness(kind, mesh, lam=2.0, mu=0.0, quadrature=RULES[kind])
    shear = stiffness(kind, mesh, lam=0.0, mu=1.0)
    found = recover_elasticity(volume.matrix + shear.matrix, cells=False)
    assert found.certified
    assert error(found.points, volume.points) < 1e-11
