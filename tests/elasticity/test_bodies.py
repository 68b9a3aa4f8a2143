"""Bodies that are no boxes, supported as engineers support them, through the public door."""

import numpy as np
import pytest
from assembled import ELEMENTS, permuted_nodes, stiffness
from supported import given, judged

import unassemble


def hollow_cylinder(kind, perturb=0.0):
    """An eighth of a thick pipe: its planes of symmetry are x = 0, y = 0 and z = 0."""
    mesh_type = ELEMENTS[kind][0]
    mesh = mesh_type.init_tensor(np.linspace(0, 1, 5), np.linspace(0, 1, 9), np.linspace(0, 1, 9))
    p = mesh.p.copy()
    inner = np.all((p > 1e-9) & (p < 1 - 1e-9), axis=0)
    p[:, inner] += perturb / 8 * np.random.default_rng(0).uniform(-1, 1, (3, inner.sum()))
    radius, angle = 1 + p[0] / 2, np.pi / 2 * p[1]
    place = np.stack([radius * np.cos(angle), radius * np.sin(angle), 2 * p[2]])
    place[np.abs(place) < 1e-12] = 0
    return mesh_type(place, mesh.t)


@pytest.mark.parametrize("order", ["interleaved", "by component", "at random"])
@pytest.mark.parametrize(("kind", "perturb"), [("hex-q1", 0.0), ("hex-q1", 0.2), ("tet-p1", 0.0)])
def test_symmetry_planes_of_a_pipe(kind, perturb, order):
    """Rows at the edges in which planes meet prove no direction; a wrong one moves the nodes around it."""
    case = given(permuted_nodes(stiffness(kind, hollow_cylinder(kind, perturb), lam=1.5)), "symmetry", order, "stored")
    found = unassemble.recover(case.matrix)
    truth = judged(found, case)
    assert found.status == "certified"
    assert truth.error < 1e-11
    assert truth.missing == 0
