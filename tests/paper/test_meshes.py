"""The paper's meshes against their published files, and the assembler against scikit-fem."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from unassemble.paper import corners_of
from unassemble_paper import meshes

SHARED = Path(__file__).resolve().parents[3] / "shared" / "paper-meshes"


@pytest.mark.parametrize(("name", "file"), [("ellipse", "fig5_ellipse.npz"), ("rocket", "fig6_rocket.npz")])
def test_same_points_and_triangles_as_the_source(name, file):
    if not (SHARED / file).exists():
        pytest.skip("the source's meshes are not here")
    published, ours = np.load(SHARED / file), getattr(meshes, name)()
    far, place = cKDTree(ours.points).query(published["points"])
    assert far.max() < 1e-6  # single precision
    assert len(set(place.tolist())) == len(ours.points)
    assert {frozenset(t) for t in place[published["triangles"]].tolist()} == {
        frozenset(t) for t in ours.triangles.tolist()
    }


def test_counts_of_the_paper(paper_case):
    c = paper_case.corners.counts
    expected = {"square": (100, 261, 162, 64, 0), "ellipse": (85, 236, 152, 69, 0), "rocket": (330, 926, 596, 266, 1)}
    assert (c.v, c.e, c.m, c.w, c.h) == expected[paper_case.name]
    assert c.surplus == 1 - c.h
    sizes = {"square": (487, 487), "ellipse": (457, 457), "rocket": (1788, 1789)}
    system = paper_case.system()
    assert (system.n_equations, system.n_unknowns) == sizes[paper_case.name]


@pytest.mark.parametrize("name", ["square", "ellipse", "rocket"])
def test_own_weights_are_those_of_scikit_fem(name, assemble, own_cases):
    ours, theirs = own_cases[name], assemble(getattr(meshes, name)())
    np.testing.assert_allclose(np.sort(ours.weights), np.sort(theirs.weights), atol=1e-13)


def test_fans_at_a_boundary_that_touches_itself():
    """Two squares' worth of triangles around a pinched vertex: one fan for every passage."""
    from unassemble.topology import surfaces

    # A ring of triangles whose inner boundary touches the outer one in vertex 0.
    rim = [0, 1, 2, 3, 4, 5, 6]
    inner = [0, 7, 8, 9, 10, 11]
    triangles = [(0, 1, 7), (1, 2, 7), (2, 8, 7), (2, 3, 8), (3, 9, 8), (3, 4, 9), (4, 10, 9), (4, 5, 10),
                 (5, 11, 10), (5, 6, 11), (6, 0, 11)]  # fmt: skip
    edges = np.unique(np.sort(np.array(triangles)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    (piece,) = surfaces(12, edges).pieces
    corners = corners_of(piece)
    assert set(rim) | set(inner) == set(range(12))
    assert corners.w == 0
    assert (corners.fan_vertex == 0).sum() == 2
    assert corners.loop_lengths.sum() == len(corners.fan_vertex) == 13
