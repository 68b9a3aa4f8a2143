"""What the paper gets wrong or leaves open: proofs are in docs/paper.md, counter-examples here."""

import networkx
import numpy as np
import pytest
from skfem import Basis, BilinearForm, ElementTriP1, MeshTri
from skfem.helpers import grad

from unassemble.paper import (
    AngleOptions,
    AngleSystem,
    NewtonOptions,
    bfs_embedding,
    corners_of,
    deficiency,
    distance,
    recover_angles,
    violations,
)
from unassemble_paper.cases import case_of
from unassemble_paper.examples import perforated, spiral_angles, two_hexagonal_holes, wheel
from unassemble_paper.meshes import Mesh


def test_theorem_1_fails_on_a_tri_connected_mesh_without_loops_of_four(assemble):
    """All that section 2.2 asks: the hole of the proof's base case cannot be said to be excluded."""
    example = assemble(two_hexagonal_holes())
    assert networkx.node_connectivity(networkx.Graph(example.piece.edges.tolist())) == 3
    assert sorted(example.corners.loop_lengths) == [6, 6, 24]
    assert np.abs(example.weights).min() > 0.1
    assert example.corners.counts.surplus == -1


@pytest.mark.parametrize("holes", [0, 1, 2, 3, 4])
def test_theorem_1_fails_for_two_holes_or_more(assemble, holes):
    c = assemble(perforated(13, holes)).corners.counts
    assert c.h == holes
    assert c.surplus == c.equations - c.unknowns == 1 - holes
    assert (c.surplus >= 0) == (holes <= 1)


def test_boundary_entries_do_not_fix_the_mesh(assemble):
    """Figure 2: the same angles face the boundary edges, and the meshes differ."""
    one, two = (assemble(wheel(np.array(r)), seed=0) for r in ([1, 1, 1, 1, 1.0], [1, 2, 1.5, 0.7, 1.2]))
    for a in (one, two):
        rim = a.piece.facing[:, 1] < 0
        np.testing.assert_allclose(a.weights[rim], 0.5 / np.tan(2 * np.pi / 5))
    assert np.abs(one.angles - two.angles).max() > 0.2


def test_conditions_1_and_2_do_not_suffice():
    """An exact spiral: all sums are right, and the wheel does not close."""
    mesh = wheel(np.ones(6))
    example = case_of(mesh, "wheel")
    right = violations(example.piece, example.corners, example.angles)
    assert max(right.triangles, right.interior, right.embedding) < 1e-12
    hub = int(example.corners.interior[0])
    twisted = np.empty((6, 3))
    for row, triangle in enumerate(example.piece.triangles):  # the hub's angle first
        twisted[row] = np.roll(spiral_angles(6, 0.1)[0], int(np.flatnonzero(triangle == hub)[0]))
    wrong = violations(example.piece, example.corners, twisted)
    assert max(wrong.triangles, wrong.interior) < 1e-12
    assert wrong.embedding > 0.1
    system = AngleSystem(example.corners, example.weights, sines=True)
    sines = system.split(system.residual(system.pack(twisted)))[4]
    growth = 6 * np.log(np.sin(np.pi / 3 + 0.1) / np.sin(np.pi / 3 - 0.1))
    assert np.abs(sines) == pytest.approx(growth)


def test_theorem_2_for_valid_sequences(paper_case):
    """BFS-Embedding from every first triangle tried finds the mesh."""
    z0 = paper_case.truth
    for root in (0, len(paper_case.piece.triangles) // 2, len(paper_case.piece.triangles) - 1):
        z = bfs_embedding(paper_case.piece, paper_case.angles, root=root)
        a, b = z - z.mean(), z0 - z0.mean()
        assert np.abs(a * (np.vdot(a, b) / np.vdot(a, a)) - b).max() < 1e-9 * np.abs(b).max()


def test_pedoe_inequality_makes_the_solution_unique(paper_case):
    """For angles that satisfy (3), the squared lengths of the true mesh weigh (1)-(2) to a sum >= 0, 0 at the truth.

    So (1)-(3) have no other solution, with c known: neither (4) nor planarity is needed for uniqueness.
    """
    z, piece = paper_case.truth, paper_case.piece
    squared = np.abs(z[piece.edges[:, 0]] - z[piece.edges[:, 1]]) ** 2
    system = AngleSystem(paper_case.corners, paper_case.weights, unknowns="angles")
    rng = np.random.default_rng(0)
    for spread in (1e-2, 0.3, 1.0, 10.0):
        shares = paper_case.angles.reshape(-1, 3) * np.exp(spread * rng.standard_normal((len(piece.triangles), 3)))
        angles = np.pi * (shares / shares.sum(axis=1, keepdims=True)).ravel()
        edges = system.split(system.residual(angles))[2]
        assert squared @ edges > 0
    exact = system.split(system.residual(paper_case.angles))[2]
    assert abs(squared @ exact) < 1e-10 * squared.sum()


@pytest.mark.parametrize(("side", "holes"), [(5, 0), (10, 1), (11, 2)])
def test_a_rank_deficient_solution_is_isolated_and_a_double_root(assemble, side, holes):
    """Exact Newton from along the null vector comes back, |F| falling by four in each step."""
    example = assemble(perforated(side, holes))
    assert deficiency(example.piece, example.corners, example.truth) > 0
    system = AngleSystem(example.corners, example.weights, unknowns="angles")
    null = np.linalg.svd(system.jacobian(example.angles).sparse().toarray())[2][-1]
    x, sizes = example.angles + 1e-2 * null / np.abs(null).max(), []
    for _ in range(7):
        value = system.residual(x)
        sizes.append(np.linalg.norm(value))
        x = x - np.linalg.lstsq(system.jacobian(x).sparse().toarray(), value, rcond=1e-6)[0]
    ratios = np.array(sizes[1:]) / np.array(sizes[:-1])
    np.testing.assert_allclose(ratios[:5], 0.25, atol=0.03)
    assert np.abs(x - example.angles).max() < 1e-3


def other_solution(example):
    """Newton with truncated least squares from a little way along the smallest singular vector, c unknown."""
    system = AngleSystem(example.corners, example.weights, unknowns="angles", scale_free=True)
    x0 = system.pack(example.angles)
    direction = np.linalg.svd(system.jacobian(x0).sparse().toarray())[2][-1]
    x = x0 + 0.05 * direction / np.abs(direction).max()
    for _ in range(20):
        x = x - np.linalg.lstsq(system.jacobian(x).sparse().toarray(), system.residual(x), rcond=1e-9)[0]
    return system, x, np.abs(x - x0)[:-1].max()


@pytest.mark.parametrize(("side", "holes"), [(9, 1), (11, 2), (13, 3)])
def test_with_a_hole_and_c_unknown_there_are_other_solutions(assemble, side, holes):
    """Exact solutions of (1)-(4) that belong to no mesh, with the paper's c above its true value.

    J has as many rows as unknowns less holes, and full rank there: they come in a family of that dimension.
    """
    example = assemble(perforated(side, holes))
    system, x, moved = other_solution(example)
    assert np.linalg.norm(system.residual(x)) < 1e-12
    assert moved > 1e-3
    assert x[:-1].min() > 0
    assert x[-1] - 1 > 1e-7  # the inequality says c >= 1
    values = np.linalg.svd(system.jacobian(x).sparse().toarray(), compute_uv=False)
    assert len(values) == system.n_unknowns - holes
    assert values[-1] > 1e-7
    assert violations(example.piece, example.corners, x[:-1]).embedding > 1e-3


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_anisotropy_contracts_and_leaves_a_rotation(assemble, angle):
    """Section 7 says that x is dilated by sqrt(Kx / Ky). It is contracted; and the matrix is that of any rotated copy.

    The recovered copy comes in no particular orientation, so that undoing the map needs one from outside.
    """
    kx, ky = 4.0, 1.0
    mesh = wheel(np.array([1.0, 1.3, 0.8, 1.1, 0.9, 1.2]))

    @BilinearForm
    def anisotropic(u, v, w):
        a, b = grad(u), grad(v)
        return kx * a[0] * b[0] + ky * a[1] * b[1]

    def matrix(points, form):
        return form.assemble(Basis(MeshTri(points.T.copy(), mesh.triangles.T.copy()), ElementTriP1())).toarray()

    @BilinearForm
    def laplace(u, v, w):
        a, b = grad(u), grad(v)
        return a[0] * b[0] + a[1] * b[1]

    given = matrix(mesh.points, anisotropic) / np.sqrt(kx * ky)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    contracted = mesh.points * [np.sqrt(ky / kx), 1.0] @ turn.T
    dilated = mesh.points * [np.sqrt(kx / ky), 1.0] @ turn.T
    np.testing.assert_allclose(matrix(contracted, laplace), given, atol=1e-13)
    assert np.abs(matrix(dilated, laplace) - given).max() > 0.5
    # Undoing the contraction along other axes gives a mesh with the same matrix, and another shape.
    undone = contracted * [np.sqrt(kx / ky), 1.0]
    np.testing.assert_allclose(matrix(undone, anisotropic) / np.sqrt(kx * ky), given, atol=1e-13)
    assert (distance(undone @ np.array([1, 1j]), mesh.points @ np.array([1, 1j])) > 0.05) == (angle != 0.0)


def test_a_triangular_hole_taken_for_an_element_fits_no_angles(assemble):
    """What the paper assumes away in section 2.2: the status says that nothing fits."""
    base = perforated(9, 0)
    t = base.triangles
    centre = base.points[t].mean(axis=1)
    island = int(np.argmin(np.hypot(*(centre - 4.0).T)))
    whole = assemble(base)
    holed = case_of(Mesh(base.points, np.delete(t, island, axis=0)), "island")
    assert len(holed.piece.triangles) == len(whole.piece.triangles)  # recognition fills it
    found = recover_angles(holed.piece, holed.weights, options=AngleOptions(newton=NewtonOptions(max_products=3_000)))
    assert not found.converged
    assert found.history.residuals.min() > 1e-2


def test_interior_vertices_are_those_on_no_boundary_edge(paper_case):
    corners = corners_of(paper_case.piece)
    inside = np.setdiff1d(np.arange(paper_case.piece.n_vertices), paper_case.piece.boundary)
    np.testing.assert_array_equal(corners.interior, inside)
