"""Sections 2.4 and 6: harmonic reduction, the tube, and the two boundary methods."""

import numpy as np
import pytest

from unassemble.errors import TopologyError
from unassemble.paper import (
    AngleSystem,
    FixedPointOptions,
    HarmonicReduction,
    angles_of,
    boundary_fixed_point,
    corners_of,
    cotangents_of,
    distance,
    part,
    ring,
    substitution,
    tube_triangles,
)
from unassemble_paper.claims_geometry import perturbed_boundary
from unassemble_paper.examples import wheel
from unassemble_paper.ranks import Ranks


def test_interior_from_boundary(paper_case):
    """Equation (6), and its matrix."""
    h = HarmonicReduction(paper_case.piece, paper_case.weights)
    on_boundary = paper_case.truth[h.boundary]
    assert np.abs(h.extend(on_boundary) - paper_case.truth).max() < 1e-12
    assert h.operator().shape == (paper_case.corners.counts.w, len(h.boundary))
    np.testing.assert_allclose(h.operator() @ on_boundary, paper_case.truth[h.interior], atol=1e-12)
    np.testing.assert_allclose(h.extend(on_boundary.real), paper_case.truth.real, atol=1e-12)


def test_the_load_in_5_is_known(paper_case):
    """b is a quarter turn of half the chord between the boundary neighbours: the paper leaves it unknown."""
    h = HarmonicReduction(paper_case.piece, paper_case.weights)
    tail, head = paper_case.piece.boundary.T
    following, previous = np.empty(len(paper_case.truth), int), np.empty(len(paper_case.truth), int)
    following[tail], previous[head] = head, tail
    z = paper_case.truth
    chord = (z[following[h.boundary]] - z[previous[h.boundary]]) / 2
    np.testing.assert_allclose(h.boundary_load(z), -1j * chord, atol=1e-12)


def test_tube(paper_case):
    tube = part(paper_case.piece, tube_triangles(paper_case.piece))
    assert len(tube.triangles) == {"square": 64, "ellipse": 32, "rocket": 136}[paper_case.name]
    assert tube.piece.n_loops == 2 * paper_case.piece.n_loops
    local = angles_of(paper_case.truth[tube.piece.vertices], tube.piece.triangles).ravel()
    np.testing.assert_allclose(local, paper_case.angles[tube.corners], atol=1e-12)
    np.testing.assert_array_equal(tube.piece.vertices[tube.piece.edges], paper_case.piece.edges[tube.piece.edge_rows])
    assert set(map(tuple, paper_case.piece.boundary)) <= set(map(tuple, tube.piece.vertices[tube.piece.boundary]))


def test_the_tubes_own_equations_are_square_and_singular(paper_case):
    if paper_case.name == "rocket":
        with pytest.raises(TopologyError, match="1 holes"):
            ring(paper_case.piece)
        return
    tube = ring(paper_case.piece)
    assert tube.piece.n_loops == 2
    corners = corners_of(tube.piece)
    system = AngleSystem(corners, np.zeros(len(tube.piece.edges)))
    found = Ranks(system, system.pack(paper_case.angles[tube.corners]))
    assert system.n_equations == system.n_unknowns
    assert found.deficiency >= 1


def test_too_small_for_a_ring(assemble):
    hub = assemble(wheel(np.ones(6)))
    with pytest.raises(TopologyError, match="too small"):
        boundary_fixed_point(hub.piece, hub.weights, np.ones(6, complex))


@pytest.mark.parametrize("embedding", ["modified-bfs", "layout"])
@pytest.mark.parametrize("loops", [False, True])
def test_the_mesh_is_a_repelling_fixed_point(paper_case, embedding, loops):
    if paper_case.name == "rocket":
        pytest.skip("holes")
    boundary = np.unique(paper_case.piece.boundary)
    options = FixedPointOptions(max_steps=4, embedding=embedding, loops=loops)
    exact = boundary_fixed_point(paper_case.piece, paper_case.weights, paper_case.truth[boundary], options)
    assert exact.converged
    assert distance(exact.z, paper_case.truth) < 1e-8
    near = boundary_fixed_point(paper_case.piece, paper_case.weights, perturbed_boundary(paper_case, 1e-7), options)
    assert not near.converged
    assert near.status.startswith(("stopped", "stalled"))
    errors = [distance(b, paper_case.truth[boundary]) for b in near.boundaries]
    assert errors[-1] > 3 * errors[1]
    assert near.residuals.shape == near.moves.shape == (4,)


def test_far_guesses_fail(paper_case):
    if paper_case.name == "rocket":
        pytest.skip("holes")
    k = len(paper_case.piece.longest_loop)
    polygon = np.empty(k, complex)
    polygon[np.argsort(np.argsort(paper_case.piece.longest_loop))] = np.exp(2j * np.pi * np.arange(k) / k)
    options = FixedPointOptions(max_steps=6, embedding="layout")
    result = boundary_fixed_point(paper_case.piece, paper_case.weights, polygon, options)
    assert not result.converged
    assert distance(result.z, paper_case.truth) > 1e-2


def test_cotangents_and_their_derivatives(paper_case):
    cotangent, (by_x, by_y) = cotangents_of(paper_case.piece, paper_case.truth)
    np.testing.assert_allclose(cotangent, 1 / np.tan(paper_case.angles), atol=1e-11)
    rng = np.random.default_rng(0)
    move = rng.standard_normal((len(paper_case.truth), 2)) @ np.array([1, 1j])
    h = 1e-7
    up, down = (cotangents_of(paper_case.piece, paper_case.truth + s * h * move)[0] for s in (1, -1))
    slope = by_x @ move.real + by_y @ move.imag
    np.testing.assert_allclose(slope, (up - down) / (2 * h), atol=1e-6 * np.abs(slope).max())


def test_substitution_converges_near_and_its_storage(paper_case):
    result = substitution(paper_case.piece, paper_case.weights, perturbed_boundary(paper_case, 1e-3))
    assert result.converged
    assert result.status.startswith("converged")
    assert distance(result.z, paper_case.truth) < 1e-10
    assert len(result.residuals) <= 7
    n_boundary = len(np.unique(paper_case.piece.boundary))
    assert result.stored == paper_case.corners.counts.w * n_boundary
    assert result.jacobian_entries % (2 * n_boundary) == 0
    assert result.stored > 3 * paper_case.corners.counts.m


def test_substitution_fails_far_from_the_rocket(paper_case):
    result = substitution(paper_case.piece, paper_case.weights, perturbed_boundary(paper_case, 0.03), max_steps=20)
    if paper_case.name == "rocket":
        assert not result.converged
        assert result.status.startswith("stopped")
