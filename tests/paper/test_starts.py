"""Starting guesses: pi/3, Tutte, weighted barycentric; |A| = 0 on Figure 4; which of them helps."""

import numpy as np
import pytest

from unassemble.errors import GeometryError, InputError
from unassemble.paper import AngleSystem, NewtonOptions, angles_of, barycentric_embedding, inverted, solve, start_angles
from unassemble_paper.examples import perforated


@pytest.mark.parametrize("kind", ["barycentric", "weighted"])
def test_embeddings_are_planar(paper_case, kind):
    springs = np.ones_like(paper_case.weights) if kind == "barycentric" else np.abs(paper_case.weights)
    z = barycentric_embedding(paper_case.piece, springs)
    assert inverted(z, paper_case.piece.triangles) == 0
    np.testing.assert_allclose(np.abs(z[paper_case.piece.longest_loop]), 1)
    # A planar embedding without holes satisfies (3) and (4).
    system = AngleSystem(paper_case.corners, paper_case.weights, unknowns="angles")
    residual = system.residual(angles_of(z, paper_case.piece.triangles).ravel())
    assert np.abs(residual[: system.row_of_edges]).max() < 1e-9


def test_every_free_vertex_is_the_mean_of_its_neighbours(paper_case):
    z = barycentric_embedding(paper_case.piece, np.ones(len(paper_case.piece.edges)))
    free = np.setdiff1d(np.arange(len(z)), paper_case.piece.longest_loop)
    for vertex in free[:: max(1, len(free) // 20)]:
        at = (paper_case.piece.edges == vertex).any(axis=1)
        neighbours = paper_case.piece.edges[at].sum(axis=1) - vertex
        assert abs(z[vertex] - z[neighbours].mean()) < 1e-12


def test_equal_angles_satisfy_the_triangle_equations_only(paper_case):
    system = AngleSystem(paper_case.corners, paper_case.weights, unknowns="angles")
    triangles, interior, _, _, _ = system.split(
        system.residual(start_angles(paper_case.piece, paper_case.weights, "equal"))
    )
    assert np.abs(triangles).max() < 1e-14
    if paper_case.name != "square":  # six triangles at every vertex of the grid
        assert np.abs(interior).max() > 1


def test_vanished_entries_of_figure_4(assemble):
    """All 81 diagonals have |A| = 0: the weighted embedding is that of the square grid without them.

    It exists, since the grid hangs together, and is planar; the diagonals just do not pull.
    """
    from unassemble_paper.meshes import square

    grid = assemble(square(10))
    assert (np.abs(grid.weights) < 1e-14).sum() == 81
    cleaned = np.where(np.abs(grid.weights) < 1e-14, 0, grid.weights)
    np.testing.assert_allclose(
        barycentric_embedding(grid.piece, np.abs(grid.weights)), barycentric_embedding(grid.piece, cleaned), atol=1e-12
    )
    assert inverted(barycentric_embedding(grid.piece, cleaned), grid.piece.triangles) == 0


def test_a_vertex_without_entries_cannot_be_placed(paper_case):
    vertex = paper_case.corners.interior[3]
    weights = np.where((paper_case.piece.edges == vertex).any(axis=1), 0, paper_case.weights)
    with pytest.raises(GeometryError, match=f"row {paper_case.piece.vertices[vertex]}"):
        start_angles(paper_case.piece, weights, "weighted")


def test_wrong_names(paper_case):
    with pytest.raises(InputError, match="random"):
        start_angles(paper_case.piece, paper_case.weights, "random")
    with pytest.raises(InputError, match="boundary loop 5"):
        start_angles(paper_case.piece, paper_case.weights, "weighted", loop=5)


@pytest.mark.parametrize("kind", ["equal", "barycentric", "weighted"])
def test_with_angles_and_sines_every_start_converges(paper_case, kind):
    system = AngleSystem(paper_case.corners, paper_case.weights, "angles", scale_free=True, sines=True)
    start = start_angles(paper_case.piece, paper_case.weights, kind)
    result = solve(system, system.pack(start), NewtonOptions(tolerance=1e-8))
    assert result.converged
    assert np.abs(system.angles(result.x) - paper_case.angles).max() < 1e-7
    assert result.products < 2_000


def test_larger_meshes_do_not_need_the_weighted_start(assemble):
    """1,500 vertices: pi/3 converges, with the paper's cotangents; the barycentric ones do not."""
    large = assemble(perforated(39, 2))
    system = AngleSystem(large.corners, large.weights, sines=True)
    ended = {
        kind: solve(
            system, system.pack(start_angles(large.piece, large.weights, kind)), NewtonOptions(max_products=3_000)
        )
        for kind in ("equal", "barycentric", "weighted")
    }
    assert ended["equal"].converged
    assert ended["equal"].products < 1_300
    assert not ended["barycentric"].converged
    assert not ended["weighted"].converged
