"""Entries with errors: error bars of lengths, and what is left to test."""

import numpy as np
import pytest
import scipy.sparse as sp
from surfaces import lattice, moebius, sheet, surface, torus

from unassemble import recover
from unassemble.linalg import SamplingOptions
from unassemble.metric import areas_cotangents, length_deviations

SIGMA = 1e-4


def noisy(matrix, sigma, seed):
    rng = np.random.default_rng(seed)
    upper = sp.triu(matrix, 0).tocoo()
    errors = sigma * rng.standard_normal(upper.nnz)
    upper.data = upper.data + errors
    return (upper + sp.triu(upper, 1).T).tocsr()


def test_error_bars_are_the_scatter():
    known = surface(*torus(12, 8), c=2.0)
    many = [
        recover(noisy(known.matrix, SIGMA, seed), operator="surface", noise=SIGMA, standard_deviations=seed == 0)
        for seed in range(60)
    ]
    scatter = np.std([one.edge_lengths for one in many], axis=0)
    ratio = scatter / many[0].length_deviations
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1, abs=0.05)
    assert ratio.max() < 1.5  # 60 of them scatter by a tenth
    assert ratio.min() > 0.6


def test_rows_that_sum_to_zero_up_to_noise():
    """One right surface in a thousand is refused."""
    known = surface(*moebius(), c=2.0)
    passed = [recover(noisy(known.matrix, SIGMA, seed), operator="surface", noise=SIGMA) for seed in range(40)]
    assert sum(one.certified for one in passed) >= 39
    p_values = np.array([one.chi_square["p_value"] for one in passed])
    assert 0.3 < p_values.mean() < 0.7
    assert 0.05 < (p_values < 0.2).mean() < 0.4
    told = recover(noisy(known.matrix, 3 * SIGMA, 0), operator="surface", noise=SIGMA)
    assert told.status == "uncertified"
    assert "by more than noise" in told.reason


def test_without_noise_told_nothing_is_certified():
    found = recover(noisy(surface(*torus()).matrix, SIGMA, 0), operator="surface")
    assert found.status == "uncertified"


def test_known_scale_is_tested_against_noise():
    known = surface(*sheet(), c=2.0, diagonal=np.arange(float(len(sheet()[0]))))
    matrix = noisy(known.matrix, SIGMA, 1)
    assert recover(matrix, operator="surface", noise=SIGMA, scale=2.0).certified
    other = recover(matrix, operator="surface", noise=SIGMA, scale=2.001)
    assert other.status == "uncertified"
    assert "standard deviations" in other.reason


def test_rows_taken_out_stand_out_of_noise():
    known = surface(*torus())
    keep = np.setdiff1d(np.arange(known.matrix.shape[0]), [17])
    found = recover(noisy(known.matrix[keep][:, keep], SIGMA, 0), operator="surface", noise=SIGMA)
    assert found.status == "uncertified"


def test_noise_that_drowns_angles():
    found = recover(noisy(surface(*torus()).matrix, 0.08, 0), operator="surface", noise=0.08)
    assert found.status == "uncertified"
    assert "too large" in found.reason


def test_random_patterns_stand_in_for_single_responses():
    triangles = lattice(10, 6, round_k=True, round_m=True)
    points, _ = torus(10, 6)
    pairs = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2)
    edges, opposite = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    opposite = opposite.reshape(-1, 3)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    squared = (length / length.mean()) ** 2
    assert np.isfinite(areas_cotangents(squared[opposite])[0]).all()
    exact = length_deviations(squared, opposite)
    sampled = length_deviations(squared, opposite, SamplingOptions(exact_up_to=0))
    np.testing.assert_allclose(sampled, exact, rtol=0.2)
