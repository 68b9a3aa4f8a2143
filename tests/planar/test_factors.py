"""Factors c of pieces that share vertices, with errors in the entries."""

from itertools import pairwise

import numpy as np
import pytest
import scipy.sparse as sp

from meshes import largest_error, random_mesh, specimen, triangle_set
from unassemble import recover
from unassemble.planar.cotangent import edge_weights
from unassemble.planar.deviations import factor_deviations
from unassemble.planar.polish import PolishOptions
from unassemble.topology import surfaces

C = 1.7


def chain(count, seed, heights=(1.0,)):
    """Triangles, or pairs of them, each of which meets the next in one vertex."""
    rng = np.random.default_rng(seed)
    points, triangles = [np.zeros(2)], []
    for _ in range(count):
        a = len(points) - 1
        for height in heights:
            points.append(points[a] + [0.5, height] + rng.uniform(-0.2, 0.2, 2))
        points.append(points[a] + [1.0, 0.0] + rng.uniform(-0.2, 0.2, 2))
        ring = list(range(a, len(points)))
        triangles += [(ring[0], ring[-1], ring[1])] + [(ring[-1], q, p) for p, q in pairwise(ring[1:-1])]
    return np.array(points), np.array(triangles)


def noisy(matrix, sigma, seed):
    """Independent errors in the upper triangle, and the same in the lower one."""
    upper = sp.triu(matrix, 1).tocoo()
    value = upper.data + sigma * np.random.default_rng(seed).standard_normal(upper.nnz)
    ends = np.r_[upper.row, upper.col], np.r_[upper.col, upper.row]
    return sp.coo_array((np.r_[value, value], ends), shape=matrix.shape)


@pytest.mark.parametrize("sigma", [1e-6, 1e-4])
@pytest.mark.parametrize("heights", [(1.0,), (0.8, 1.5)])
@pytest.mark.parametrize("count", [8, 20])
def test_noise_explains_that_factors_differ(count, heights, sigma):
    known = specimen(*chain(count, count, heights), c=C, seed=3)
    found = recover(noisy(known.matrix, sigma * C, 1), noise=sigma * C)
    assert "no entry to spare" in found.reason  # of each piece
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
    assert np.ptp(found.scale) == 0  # all pieces are fitted with one
    assert found.chi_square["degrees_of_freedom"] == count - 1


def deviates(found, known, rows):
    """Error of a piece, the best similarity onto the truth being taken off, over its error bars; root mean squares."""
    true, z = known.points[rows] @ [1, 1j], found.points[rows] @ [1, 1j]
    true, z = true - true.mean(), z - z.mean()
    errors = [z - s * (np.vdot(s, z) / np.vdot(s, s)) for s in (true, true.conj())]
    return min(map(np.linalg.norm, errors)) / np.linalg.norm(found.standard_deviations[rows])


def test_error_bars_of_pieces_with_one_factor():
    """A triangle by itself tells neither c nor how large the noise is; all together do."""
    known, sigma = specimen(*chain(12, 5), c=C, seed=3), 1e-5 * C
    squares, levels = [], []
    for seed in range(40):
        found = recover(noisy(known.matrix, sigma, seed), noise=sigma, standard_deviations=True)
        squares += [deviates(found, known, rows) ** 2 for rows in known.triangles]
        levels.append(found.estimated_noise / sigma)
    assert np.mean(np.square(levels)) == pytest.approx(1, abs=0.3)
    assert np.mean(squares) == pytest.approx(1, abs=0.3)


def with_tied_triangles(n, count, seed):
    """A random mesh in which some triangles have lost their three neighbours: each hangs by all of its corners."""
    points, triangles = random_mesh(n, seed, holes=False)
    sides = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2) @ [len(points), 1]
    boundary = np.bincount(np.unique(sides, return_inverse=True)[1].ravel()) == 1
    keep, taken = np.ones(len(triangles), bool), np.zeros(len(points), bool)
    edge = np.unique(sides)[boundary]
    taken[np.r_[edge // len(points), edge % len(points)]] = True
    for k in np.random.default_rng(seed).permutation(len(triangles)).tolist():
        around = np.isin(sides, sides[k]).any(axis=1)
        around[k] = False
        if count and not taken[triangles[around]].any():
            keep[around] = False
            taken[triangles[around]] = True
            count -= 1
    assert not count
    return points, triangles[keep]


@pytest.mark.parametrize("options", [{}, {"scale": C}], ids=str)
@pytest.mark.parametrize("sigma", [1e-9, 1e-5])
def test_pieces_that_hold_each_other_are_fitted_as_they_do(sigma, options):
    """Each by itself has no reason to meet the others where it should."""
    known = specimen(*with_tied_triangles(120, 3, 1), c=C, seed=3)
    found = recover(noisy(known.matrix, sigma * C, 1), noise=sigma * C, **options)
    assert found.certified, found.reason
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
    assert len(found.scale) == 4
    entries = sp.triu(known.matrix, 1).nnz
    assert found.chi_square["degrees_of_freedom"] == entries - 2 * len(known.points) + 4 - ("scale" not in options)
    assert found.chi_square["p_value"] > 1e-3
    assert largest_error(found.points, known.points) < 20 * sigma


@pytest.mark.slow
@pytest.mark.parametrize("told", [True, False])
def test_error_bars_of_pieces_that_hold_each_other(told):
    known, sigma = specimen(*with_tied_triangles(80, 2, 1), c=C, seed=3), 3e-8 * C
    every = np.arange(len(known.points))
    squares, levels = [], []
    for seed in range(20):
        found = recover(noisy(known.matrix, sigma, seed), noise=sigma if told else None, standard_deviations=True)
        squares.append(deviates(found, known, every) ** 2)
        levels.append(found.estimated_noise / sigma)
    assert np.mean(np.square(levels)) == pytest.approx(1, abs=0.35)
    assert np.mean(squares) == pytest.approx(1, abs=0.5)


@pytest.mark.parametrize("sigma", [1e-8, 1e-4])
def test_noise_is_told_beside_holes_that_may_be_filled(sigma):
    """Filled, they fit with another factor; without being told the noise nothing is certified, whichever it is."""
    known = specimen(*with_rings(2, 0), c=C, seed=0)
    found = recover(noisy(known.matrix, sigma * C, 1))
    assert found.status == "uncertified"
    assert found.estimated_noise == pytest.approx(sigma * C, rel=0.6)


@pytest.mark.parametrize("sigma", [1e-5, 1e-3])
def test_a_small_misfit_of_few_entries_is_said_to_be_as_noise_would_leave_it(sigma):
    known = specimen(*with_rings(2, 0, hole=False), c=C, seed=3)
    found = recover(noisy(known.matrix, sigma * C, 1))
    assert (
        f"noise of standard deviation {found.estimated_noise:.2g} (absolute) in the entries would leave as much"
        in found.reason
    )
    assert "no set of cells" not in found.reason


def test_more_than_noise_is_none():
    """Half of the triangles have another factor."""
    points, triangles = chain(20, 5)
    halves = (triangles[:10], C), (triangles[10:], 1.001 * C)
    both = [specimen(points, some, c=c, seed=3).matrix for some, c in halves]
    found = recover(noisy(both[0] + both[1], 1e-6 * C, 1), noise=1e-6 * C)
    assert not found.certified


def test_two_triangles_agree_too_roughly():
    known = specimen(*chain(2, 1), c=C, seed=3)
    found = recover(noisy(known.matrix, 1e-3 * C, 1), noise=1e-3 * C)
    assert not found.certified


def with_rings(count, seed, hole=True, filled=False):
    """A random mesh, and rings of three triangles about a hole that hang on it, or single triangles, by a vertex."""
    points, triangles = random_mesh(16, seed, holes=False)
    ring = np.array([[0, 0], [1, 0], [0.5, 0.8], [0.5, -0.8], [1.4, 0.7], [-0.4, 0.7]])
    cells = np.array([(0, 3, 1), (1, 4, 2), (2, 5, 0), (0, 1, 2)][: 4 if filled else 3])
    if not hole:
        ring, cells = ring[:3], np.array([(0, 1, 2)])
    rng = np.random.default_rng(seed)
    for at in range(count):
        placed = ring + rng.uniform(-0.1, 0.1, ring.shape)
        placed += points[at] - placed[-1]
        number = np.r_[len(points) + np.arange(len(ring) - 1), at]
        points, triangles = np.concatenate([points, placed[:-1]]), np.concatenate([triangles, number[cells]])
    return points, triangles


@pytest.mark.parametrize(("seed", "sigma"), [(0, 1e-6), (1, 1e-5), (2, 1e-4)])
def test_noise_excuses_no_filled_hole(seed, sigma):
    """Filled, a hole leaves a piece that fits with another factor; how large a misfit is elsewhere is no excuse."""
    known = specimen(*with_rings(2, seed), c=C, seed=seed)
    found = recover(noisy(known.matrix, sigma * C, 1), noise=sigma * C)
    assert not found.certified or triangle_set(found.triangles) == triangle_set(known.triangles)


def test_single_triangles_on_a_mesh_that_tells_the_factor():
    known = specimen(*with_rings(2, 0, hole=False), c=C, seed=3)
    found = recover(noisy(known.matrix, 1e-4 * C, 1), noise=1e-4 * C)
    assert found.certified, found.reason


@pytest.mark.parametrize(("sigma", "enough"), [(1e-9, True), (1e-5, False)])
def test_loose_pieces_do_not_vouch_for_each_other(sigma, enough):
    """Of each of five the triangle in the middle may be a hole, and that it is none has to be told by itself."""
    known = specimen(*with_rings(5, 0, filled=True), c=C, seed=3)
    found = recover(noisy(known.matrix, sigma * C, 1), noise=sigma * C)
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
    assert found.certified == enough
    assert enough or "They agree too roughly" in found.reason


def test_common_fit_that_does_not_converge_is_left_out(monkeypatch):
    known, sigma = specimen(*chain(8, 1), c=C, seed=3), 1e-6 * C
    monkeypatch.setattr("unassemble.scalar.factors.refined_together", lambda *_, **__: None)
    found = recover(noisy(known.matrix, sigma, 1), noise=sigma)
    assert found.status == "uncertified"
    assert "did not converge, and each was fitted by itself" in found.reason
    assert "more than noise" not in found.reason
    assert any("each was fitted by itself" in warning for warning in found.warnings)
    assert max(largest_error(found.points[rows], known.points[rows]) for rows in known.triangles) < 20 * sigma


def test_pieces_too_large_to_be_fitted_together_are_said_to_be(monkeypatch):
    known, sigma = specimen(*chain(8, 1), c=C, seed=3), 1e-6 * C
    monkeypatch.setattr("unassemble.scalar.factors.PolishOptions", lambda: PolishOptions(direct_limit=10))
    found = recover(noisy(known.matrix, sigma, 1), noise=sigma)
    assert found.status == "uncertified"
    assert "Errors of the entries explain that, but they have too many vertices to be fitted together" in found.reason


def test_deviation_of_a_factor():
    """That of log c over many draws, for a lone triangle."""
    piece = surfaces(3, np.array([(0, 1), (0, 2), (1, 2)])).pieces[0]
    z = np.array([0, 1 + 0.1j, 0.4 + 0.8j])
    z = z if edge_weights(piece, z).sum() > 0 else np.conj(z)
    a, b, c = (edge_weights(piece, z) + 1e-6 * np.random.default_rng(0).standard_normal((4000, 3))).T
    expected = np.log(2 * np.sqrt(a * b + b * c + c * a)).std() / 1e-6
    assert factor_deviations([piece], [z], [None])[0] == pytest.approx(expected, rel=0.1)
