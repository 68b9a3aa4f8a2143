"""Where planes of rollers meet: nodes that only rows touch which lack coefficients of every direction."""

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import Assembled, box, heterogeneous, permuted_nodes, stiffness, vector_laplace
from supported import Given, assert_certified, given, judged, with_zeros

from unassemble.elasticity import recover_elasticity
from unassemble.elasticity.nodal import nodal_matrix, valid_pairs
from unassemble.elasticity.nullspace.corners import said
from unassemble.elasticity.nullspace.identities import identities
from unassemble.elasticity.unknowns import given_numbering


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
def test_three_symmetry_planes_lose_no_node(kind, support, material):
    """The node in the corner is not in the matrix; that it lies on all planes places those next to it.

    Where unknowns were eliminated, order tells which rows are one node's where they are single; elsewhere the elements
    in the corner do, one of whose corners is not in the matrix.
    """
    counts = (3, 4, 4) if kind != "tet-p2" else (3, 4, 3)
    body = permuted_nodes(stiffness(kind, box(kind, counts, perturb=0.2), **MATERIALS[material]), seed=1)
    case = given(body, support, "interleaved", "stored")
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-11
    assert truth.split == 0
    # No elements re-assemble a material that varies within these, to show the three nodes next to the corner.
    assert truth.missing <= (0.02 if (kind, material) == ("hex-s2", "varying") else 0)
    assert any("planes" in one for one in found.warnings)


@pytest.mark.parametrize("perturb", [0.0, 0.2])
@pytest.mark.parametrize("material", MATERIALS)
def test_elements_in_the_corner_show_rows_component_by_component(material, perturb):
    """In regular meshes entries of their nodes vanish, or were taken out with the directions that rollers hold."""
    body = permuted_nodes(stiffness("tet-p2", box("tet-p2", (3, 4, 3), perturb=perturb), **MATERIALS[material]), seed=1)
    case = given(body, "symmetry", "by component", "stored")
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-11
    assert truth.missing == 0
    assert max(map(int, (cells.max() for cells in found.cells.blocks.values()))) < len(found.points)


@pytest.mark.parametrize(("kind", "material"), [("hex-s2", "varying"), ("hex-s2", "one"), ("hex-q2", "one")])
def test_three_rows_in_order_are_not_taken_for_one_node(kind, material):
    """Middles of the edges next to the corner, x of one, y and z of the others: to the equations they could be."""
    body = stiffness(kind, box(kind, (3, 4, 4), perturb=0.2), **MATERIALS[material])
    edges = [
        np.linalg.norm(body.points - np.eye(3)[a] * h, axis=1).argmin() for a, h in enumerate((1 / 4, 1 / 6, 1 / 6))
    ]
    others = np.setdiff1d(np.random.default_rng(1).permutation(len(body.points)), edges)
    order = np.concatenate([edges, np.random.default_rng(1).permutation(others)])
    rows = (order[:, None] * 3 + np.arange(3)).ravel()
    case = given(
        Assembled(body.matrix[rows][:, rows], body.points[order], body.cells), "symmetry", "interleaved", "stored"
    )
    assert case.direction[:3].tolist() == [0, 1, 2]
    assert len(np.unique(case.node[:3])) == 3
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-11
    assert 0 < truth.missing < 0.03


@pytest.mark.parametrize("kind", ["tri-p2", "quad-s2", "quad-q2"])
def test_in_the_plane_poissons_ratio_is_needed(kind):
    mesh = box(kind, (5, 6), perturb=0.2)
    for material, lost in (("one", False), ("varying", True)):
        body = permuted_nodes(stiffness(kind, mesh, **MATERIALS[material]), seed=1)
        case = given(body, "symmetry", "interleaved", "stored")
        found = recover_elasticity(case.matrix)
        truth = judged(found, case)
        assert found.certified
        assert truth.error < 1e-9
        assert truth.missing < 0.05
        assert (truth.missing > 0) == (lost or kind != "tri-p2")  # of quadrilaterals too few rows are left


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


@pytest.mark.parametrize(("form", "least", "most"), [(None, 12, 21), (vector_laplace, 3, 3)])
def test_equations_without_coefficients_say_nothing(form, least, most):
    """Where directions are not coupled, entries between them vanish, and so does what would have to fit."""
    given_matrix = stiffness("hex-s2", box("hex-s2", (3, 3, 3), perturb=0.2), form=form).matrix
    n = given_matrix.shape[0] // 3
    numbering = given_numbering(given_matrix, np.repeat(np.arange(n), 3), np.tile(np.arange(3), n))
    nodal = nodal_matrix(given_matrix, numbering)
    around = identities(nodal, valid_pairs(nodal), np.arange(n))
    every = np.ones(len(around.rows), dtype=bool)
    assert (around.equations == 21).all()
    assert least * n <= said(around, every) <= most * n


def test_elements_confirm_rows_that_order_leaves_open():
    """Nodes of the same neighbours, which order and planes join rightly; those joined otherwise no element shows."""
    body = permuted_nodes(stiffness("hex-q2", box("hex-q2", (4, 4, 4), perturb=0.2), **MATERIALS["one"]), seed=1)
    case = given(body, "symmetry", "boundary first by component", "stored")
    assert_certified(case, 1e-11, 0.02)
