"""Section 5: BFS-Embedding, Modified BFS-Embedding, Coordinate-Smoothing, and the least-squares layout."""

import numpy as np
import pytest

from unassemble.paper import (
    aligned,
    angles_of,
    bfs_embedding,
    coordinate_smoothing,
    corner_equations,
    distance,
    dual_order,
    inverted,
    law_of_sines,
    least_squares_layout,
    signed_angles,
    violations,
)
from unassemble_paper.multilevel import multilevel_embedding


@pytest.mark.parametrize("averaging", [False, True])
def test_bfs_is_exact_for_exact_angles(paper_case, averaging):
    z = bfs_embedding(paper_case.piece, paper_case.angles, averaging=averaging)
    assert distance(z, paper_case.truth) < 1e-10
    assert inverted(z, paper_case.piece.triangles) == 0
    u, v, _ = paper_case.piece.triangles[0]
    if not averaging:
        assert z[u] == 0
        assert z[v] == 1


def test_layout_is_exact_for_exact_angles(paper_case):
    z = least_squares_layout(paper_case.piece, paper_case.angles)
    assert distance(z, paper_case.truth) < 1e-12
    assert np.abs(corner_equations(paper_case.piece, paper_case.angles) @ paper_case.truth).max() < 1e-12


def test_patches_joined_two_by_two(paper_case):
    """The multilevel embedding: exact for exact angles, in few levels, and far better than BFS-Embedding for others."""
    z, levels = multilevel_embedding(paper_case.piece, paper_case.angles)
    assert distance(z, paper_case.truth) < 1e-13
    assert levels <= 2 + np.log2(len(paper_case.angles) / 3)
    rough = paper_case.angles + 1e-3 * np.random.default_rng(0).standard_normal(paper_case.angles.size)
    z, _ = multilevel_embedding(paper_case.piece, rough)
    assert distance(z, paper_case.truth) < 0.3 * distance(bfs_embedding(paper_case.piece, rough), paper_case.truth)


def test_every_triangle_is_entered_through_an_earlier_one(paper_case):
    order, entering = dual_order(paper_case.piece, 5)
    assert order[0] == 5
    assert sorted(order) == list(range(len(order)))
    seen = {5}
    for t in order[1:]:
        edge = paper_case.piece.opposite[t, entering[t]]
        assert {int(c) // 3 for c in paper_case.piece.facing[edge]} & seen
        seen.add(int(t))


def test_bfs_is_unstable_and_smoothing_and_layout_are_not(paper_case):
    """Independent errors of 1e-3 in the angles, geometric means over ten draws; averaging alone may even do harm."""
    logarithms = []
    for seed in range(10):
        angles = paper_case.angles + 1e-3 * np.random.default_rng(seed).standard_normal(paper_case.angles.size)
        averaged = bfs_embedding(paper_case.piece, angles, averaging=True)
        found = (
            bfs_embedding(paper_case.piece, angles),
            averaged,
            coordinate_smoothing(paper_case.piece, angles, averaged),
            least_squares_layout(paper_case.piece, angles),
        )
        logarithms.append([np.log(distance(z, paper_case.truth)) for z in found])
        assert inverted(found[3], paper_case.piece.triangles) == 0
    bfs, averaged, smooth, layout = np.exp(np.mean(logarithms, axis=0))
    assert layout < 1e-3
    assert layout < smooth < averaged
    if paper_case.name != "rocket":  # "does not always correct long range losses", section 5.1
        assert smooth < 0.3 * bfs


def test_law_of_sines_jacobian_against_differences(paper_case):
    rng = np.random.default_rng(1)
    n = paper_case.piece.n_vertices
    s2 = np.sin(paper_case.angles.reshape(-1, 3) + 0.1) ** 2
    value, jacobian = law_of_sines(paper_case.piece, s2, paper_case.truth)
    step = rng.standard_normal(2 * n)
    h, move = 1e-6, step[:n] + 1j * step[n:]
    up, down = (law_of_sines(paper_case.piece, s2, paper_case.truth + s * h * move)[0] for s in (1, -1))
    np.testing.assert_allclose(jacobian @ step, (up - down) / (2 * h), atol=1e-7)
    exact = np.sin(paper_case.angles.reshape(-1, 3)) ** 2
    assert np.abs(law_of_sines(paper_case.piece, exact, paper_case.truth)[0]).max() < 1e-12
    # The paper's equations have a second solution: all points in one place.
    assert not law_of_sines(paper_case.piece, s2, np.zeros(n, complex))[0].any()
    assert value.any()


def test_smoothing_lowers_its_residual_and_does_not_collapse(paper_case):
    angles = paper_case.angles + 1e-2 * np.random.default_rng(2).standard_normal(paper_case.angles.size)
    before = bfs_embedding(paper_case.piece, angles, averaging=True)
    after = coordinate_smoothing(paper_case.piece, angles, before)
    s2 = np.sin(angles.reshape(-1, 3)) ** 2
    sizes = [np.linalg.norm(law_of_sines(paper_case.piece, s2, z)[0]) for z in (before, after)]
    assert sizes[1] < sizes[0]
    assert np.ptp(after.real) > 0.3 * np.ptp(before.real)


def test_violations_and_signed_angles(paper_case):
    right = violations(paper_case.piece, paper_case.corners, paper_case.angles)
    assert max(right.triangles, right.interior, right.embedding) < 1e-9
    turned = signed_angles(paper_case.truth.conj(), paper_case.piece.triangles)
    np.testing.assert_allclose(-turned, angles_of(paper_case.truth, paper_case.piece.triangles), atol=1e-12)
    assert inverted(paper_case.truth.conj(), paper_case.piece.triangles) == len(paper_case.piece.triangles)
    wrong = violations(paper_case.piece, paper_case.corners, paper_case.angles + 0.01)
    assert wrong.triangles == pytest.approx(0.03)
    assert wrong.interior > 0.03


def test_alignment():
    rng = np.random.default_rng(3)
    z = rng.standard_normal((9, 2)) @ np.array([1, 1j])
    assert np.abs(aligned(3 * np.exp(1j) * z + 7, z) - z).max() < 1e-13
    assert distance((2j * z + 1).conj(), z) < 1e-13
    assert distance(rng.standard_normal((9, 2)) @ np.array([1, 1j]), z) > 0.1
