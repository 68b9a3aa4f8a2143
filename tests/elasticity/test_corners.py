"""Where planes of rollers meet: nodes that only rows touch which lack coefficients of every direction."""

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import Assembled, box, heterogeneous, permuted_nodes, recover_elasticity, stiffness
from supported import Given, assert_certified, given, judged, with_zeros


def varying_shear(x):
    return 1 + x[1] + x[0] * x[1]


MATERIALS = {"one": {"lam": 1.5, "mu": 1.0}, "varying": {"lam": heterogeneous, "mu": varying_shear}}


def with_corner_moved(kind: str, counts: tuple[int, ...], offset, perturb: float, material: str) -> tuple:
    """A box whose corner at the origin, and nothing else of the mesh, is moved; and its points before that."""
    mesh = box(kind, counts, perturb=perturb)
    p = mesh.p.copy()
    p[:, np.abs(p).max(axis=0) < 1e-9] += np.reshape(offset, (-1, 1))
    moved = stiffness(kind, type(mesh)(p, mesh.t), **MATERIALS[material])
    return moved, stiffness(kind, mesh, **MATERIALS[material]).points


def held_where(case: Assembled, before: np.ndarray) -> Given:
    """Rollers on the first planes across all axes, as the nodes lay before; nodes in any order."""
    n, d = before.shape
    gone = np.abs(before) < 1e-9
    nodes = np.random.default_rng(3).permutation(n)
    rows = (nodes[:, None] * d + np.arange(d)).ravel()
    rows = rows[~gone.ravel()[rows]]
    matrix = with_zeros(case.matrix, d, "stored")
    return Given(sp.csr_array(matrix[rows][:, rows]), rows // d, rows % d, case.points)


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("support", ["symmetry", "identity rollers"])
@pytest.mark.parametrize("kind", ["tet-p2", "hex-s2", "hex-q2"])
def test_three_symmetry_planes_lose_nodes_in_their_corner_only(kind, support, material):
    """The node in the corner is not in the matrix, and rows next to it lack coefficients of every direction."""
    counts = (3, 4, 4) if kind != "tet-p2" else (3, 4, 3)
    body = permuted_nodes(stiffness(kind, box(kind, counts, perturb=0.2), **MATERIALS[material]), seed=1)
    case = given(body, support, "interleaved", "stored")
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-11
    assert truth.split == 0
    assert truth.missing < 0.1
    assert any("planes" in one for one in found.warnings)


@pytest.mark.parametrize("offset", [(0.06, 0.05, -0.04), (0.05, 0.0, 0.0)])
@pytest.mark.parametrize("kind", ["tet-p2", "hex-s2", "hex-q2"])
def test_a_corner_off_the_planes_places_nothing(kind, offset):
    case = held_where(*with_corner_moved(kind, (3, 3, 3), offset, 0.2, "varying"))
    found = recover_elasticity(case.matrix)
    assert not (found.certified and judged(found, case).error > 1e-9)
    near = np.linalg.norm(case.points, axis=1) < 0.3
    assert not np.isfinite(found.points[found.node_of_row[near[case.node]]]).all()


@pytest.mark.parametrize("perturb", [0.0, 0.2])
@pytest.mark.parametrize("offset", [(-0.066, 0.05), (0.0, 0.06), (0.05, 0.05)])
@pytest.mark.parametrize("kind", ["tri-p2", "quad-s2", "quad-q2"])
def test_nodes_that_hang_on_an_assumption_alone_get_no_coordinates(kind, offset, perturb):
    """Middles of sides that lack a direction but are off its plane: as many equations as coordinates fit anyhow."""
    case = held_where(*with_corner_moved(kind, (4, 4), offset, perturb, "one"))
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-9
    if kind == "tri-p2" and offset[0]:
        assert truth.missing > 0


def test_elements_confirm_rows_that_order_leaves_open():
    """Nodes of the same neighbours, which order and planes join rightly; those joined otherwise no element shows."""
    body = permuted_nodes(stiffness("hex-q2", box("hex-q2", (4, 4, 4), perturb=0.2), **MATERIALS["one"]), seed=1)
    case = given(body, "symmetry", "boundary first by component", "stored")
    assert_certified(case, 1e-11, 0.05)
