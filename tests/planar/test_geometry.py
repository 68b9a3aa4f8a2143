"""Conformal solve, derivatives, polish, frames and certificate, one by one."""

import numpy as np
import pytest

from meshes import edge_list, largest_error, random_mesh, specimen
from unassemble import GeometryError, SolverError
from unassemble.certificate import certify
from unassemble.linalg import SamplingOptions
from unassemble.planar import (
    PolishOptions,
    WeightJacobian,
    canonical_frame,
    collinear,
    conformal_map,
    covariances,
    edge_weights,
    estimate_scale,
    fit_similarity,
    polish,
    weight_gradient,
)
from unassemble.topology import surfaces


def single_piece(n=400, seed=0, c=1.0):
    known = specimen(*random_mesh(n, seed), c=c, seed=seed)
    edges = edge_list(known.triangles)
    (piece,) = surfaces(len(known.points), edges).pieces
    weights = -np.asarray(known.matrix[edges[:, 0], edges[:, 1]]).ravel()
    return piece, weights, known.points @ [1, 1j]


def xy(z):
    return np.column_stack([z.real, z.imag])


def test_weights_are_those_of_scikit_fem():
    piece, weights, z = single_piece()
    z = z if mean_orientation(piece, z) > 0 else np.conj(z)
    assert edge_weights(piece, z) == pytest.approx(weights, abs=1e-13)


def test_flat_triangles_have_no_weights_and_give_no_warnings():
    piece, _, z = single_piece(100)
    a, _, c = piece.triangles[0]
    z[c] = z[a]
    with np.errstate(all="raise"):
        weights = edge_weights(piece, z)
        WeightJacobian(piece, z, np.ones(len(weights)))
    assert not np.isfinite(weights).all()


def mean_orientation(piece, z):
    a, b, c = z[piece.triangles].T
    return (np.conj(b - a) * (c - a)).imag.sum()


def test_weight_gradient_against_differences():
    piece, _, z = single_piece(100)
    rng = np.random.default_rng(0)
    move = rng.standard_normal((len(z), 2)) @ [1, 1j] * np.abs(np.diff(z[piece.edges[0]]))
    step = 1e-6
    differences = (edge_weights(piece, z + step * move) - edge_weights(piece, z - step * move)) / (2 * step)
    g = weight_gradient(piece, z)
    exact = (g * move[piece.stencil]).real.sum(axis=0)
    assert exact == pytest.approx(differences, rel=1e-5, abs=1e-6 * np.abs(exact).max())
    jacobian = WeightJacobian(piece, z)
    assert jacobian.forward(move) == pytest.approx(exact)
    r = rng.standard_normal(len(exact))
    assert np.vdot(jacobian.transpose(r), move).real == pytest.approx(r @ exact)
    for field in (np.ones(len(z)) + 0j, 1j * np.ones(len(z)), z, 1j * z):  # similarities change no weight
        assert np.abs(jacobian.forward(field)).max() < 1e-10


@pytest.mark.fallback
@pytest.mark.parametrize("c", [1.0, -8.0, 1e-5, 1.02, 1.3])
@pytest.mark.parametrize("sharp", [True, False])
def test_conformal_map(c, sharp):
    piece, weights, z = single_piece(800, seed=2, c=c)
    found = conformal_map(piece, weights, sharp=sharp)
    assert found.converged
    assert found.scale == pytest.approx(c, rel=1e-12)
    assert largest_error(xy(found.z), xy(z)) < (1e-9 if sharp else 1e-4)
    assert found.factorisations <= 4


def test_scale_one_takes_one_factorisation():
    piece, weights, _ = single_piece(2000)
    assert conformal_map(piece, weights).factorisations == 1
    piece, weights, _ = single_piece(2000, c=5.0)
    assert conformal_map(piece, weights, scale=5.0).factorisations == 1
    assert conformal_map(piece, weights).factorisations <= 3


def test_search_that_is_cut_short_says_so():
    piece, weights, _ = single_piece(500, c=7.0)
    found = conformal_map(piece, weights, most=1)
    assert not found.converged


@pytest.mark.parametrize("seed", range(6))
def test_estimate_of_the_scale(seed):
    piece, weights, _ = single_piece(500, seed=seed, c=-3.0)
    assert estimate_scale(piece, weights) == pytest.approx(-3.0, rel=0.2)


def test_entries_that_add_up_to_zero():
    piece, weights, _ = single_piece(50)
    with pytest.raises(GeometryError, match="add up to zero"):
        conformal_map(piece, np.zeros_like(weights))


def test_polish_reaches_rounding_level_with_one_factorisation():
    piece, weights, z = single_piece(1500, c=3.0)
    z = z if mean_orientation(piece, z) > 0 else np.conj(z)
    start = z + 1e-5 * z**2
    found = polish(piece, weights, start)
    assert found.converged
    assert found.factorisations == 1
    assert largest_error(xy(found.z), xy(z)) < 1e-14
    assert found.scale == pytest.approx(3.0, rel=1e-14)


def test_polish_that_is_cut_short_says_so():
    piece, weights, z = single_piece(500)
    z = z if mean_orientation(piece, z) > 0 else np.conj(z)
    found = polish(piece, weights, z + 1e-2 * z**2, options=PolishOptions(max_steps=1))
    assert not found.converged


def test_meshes_beyond_memory_are_not_polished():
    piece, weights, z = single_piece(300, c=-3.0)
    with pytest.raises(SolverError, match="more than 100 vertices"):
        polish(piece, weights, z, options=PolishOptions(most_vertices=100))


def test_polish_of_noisy_entries_beats_the_null_vector():
    piece, weights, z = single_piece(3000, seed=5)
    sigma = 1e-7
    noisy = weights + sigma * np.random.default_rng(1).standard_normal(len(weights))
    start = conformal_map(piece, noisy)
    found = polish(piece, noisy, start.z)
    assert found.converged
    assert largest_error(xy(found.z), xy(z)) < 0.5 * largest_error(xy(start.z), xy(z))


def test_error_bars_are_those_of_repeated_draws():
    piece, weights, z = single_piece(150, seed=6)
    if mean_orientation(piece, z) < 0:
        z = np.conj(z)
    sigma, rng = 1e-6, np.random.default_rng(3)
    pins = np.array([0, len(z) - 1])
    predicted = sigma**2 * covariances(WeightJacobian(piece, z), weights, z, pins, free_scale=True)
    draws = []
    for _ in range(150):
        found = polish(piece, weights + sigma * rng.standard_normal(len(weights)), z).z
        frame, _ = fit_similarity(found, z)
        draws.append(frame(found) - z)
    draws = np.array(draws)
    spread = np.sqrt((draws.real**2).mean(axis=0) + (draws.imag**2).mean(axis=0))
    expected = np.sqrt(np.trace(predicted, axis1=1, axis2=2))
    assert np.sqrt((spread**2).mean() / (expected**2).mean()) == pytest.approx(1, abs=0.1)
    assert np.median(spread / expected) == pytest.approx(1, abs=0.1)


def test_sampled_error_bars_agree_with_exact_ones():
    piece, _, z = single_piece(150, seed=6)
    known = WeightJacobian(piece, z), edge_weights(piece, z), z, np.array([0, len(z) - 1])
    exact = covariances(*known, free_scale=False)
    sampled = covariances(*known, free_scale=False, options=SamplingOptions(exact_up_to=0))
    ratio = np.sqrt(np.trace(sampled, axis1=1, axis2=2) / np.trace(exact, axis1=1, axis2=2))
    assert np.median(ratio) == pytest.approx(1, abs=0.05)
    assert ratio.std() < 0.08


@pytest.mark.parametrize("seed", range(8))
def test_canonical_frame_undoes_any_similarity(seed):
    piece, _, z = single_piece(120, seed=1)
    rng = np.random.default_rng(seed)
    turn = 10 ** rng.uniform(-3, 3) * np.exp(2j * np.pi * rng.uniform())
    moved = turn * (np.conj(z) if seed % 2 else z) + complex(*rng.standard_normal(2))
    first, second = (canonical_frame(some, piece.edges, piece.boundary)[0](some) for some in (z, moved))
    assert np.abs(first - second).max() < 1e-11


def test_ties_are_named():
    square = np.array([0, 1, 1 + 1j, 1j])
    edges = np.array([[0, 1], [1, 2], [2, 3], [0, 3]])
    assert "second moments" in canonical_frame(square, edges, edges)[1]
    rectangle = square.real * 2 + 1j * square.imag
    assert "third moments vanish" in canonical_frame(rectangle, edges, edges)[1]


def test_fit_of_a_similarity():
    z = np.array([0, 1, 2 + 1j, -1j])
    target = (2 - 1j) * np.conj(z) + 3
    frame, misfit = fit_similarity(z, target, mirror=True)
    assert misfit < 1e-15
    assert frame(z) == pytest.approx(target)
    assert fit_similarity(z, target)[1] > 0.1
    assert collinear(np.array([0, 1 + 1j, 3 + 3j]))
    assert not collinear(z)


def test_certificate_sees_every_kind_of_error():
    points, triangles = random_mesh(200)
    edges = edge_list(triangles)
    known = specimen(points, triangles, tensor=(2.0, 0.3, 1.0), c=-4.0)
    edges = edge_list(known.triangles)
    entries = np.asarray(known.matrix[edges[:, 0], edges[:, 1]]).ravel()
    factor = np.full(len(known.triangles), -4.0)
    factors, tensor, cells = {"triangle": factor}, (2.0, 0.3, 1.0), {"triangle": known.triangles}

    def error(edges, entries, points, cells, factors=factors):
        return certify(edges, entries, points, cells, factors, tensor=tensor).backward_error

    assert error(edges, entries, known.points, cells) < 1e-13
    flipped = known.triangles[:, [0, 2, 1]]
    assert error(edges, entries, known.points, {"triangle": flipped}) < 1e-13
    moved = known.points.copy()
    moved[5] += 1e-6
    assert 1e-8 < error(edges, entries, moved, cells) < 1e-2
    assert error(edges[:-1], entries[:-1], known.points, cells) > 1e-3
    fewer = {"triangle": known.triangles[1:]}, {"triangle": factor[1:]}
    assert error(edges, entries, known.points, *fewer) > 1e-3
    wrong = entries.copy()
    wrong[7] *= 1.001
    certificate = certify(edges, wrong, known.points, cells, factors, tensor=tensor)
    assert certificate.backward_error > 1e-6
    assert certificate.worst()[0][0].tolist() == edges[7].tolist()
    undone = known.points.copy()
    undone[3] = np.nan
    assert error(edges, entries, undone, cells) == np.inf
