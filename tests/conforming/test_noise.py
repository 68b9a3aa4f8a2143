"""Noise and few digits: the chi-square test, and errors at the bound of Cramer and Rao."""

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import MeshTri

from conforming.assembled import assembled, cell_sets, quadrilaterals
from meshes import random_mesh
from unassemble import RecoveryError, recover

SIGMA = 1e-6


def triangles(n=100, seed=0):
    points, cells = random_mesh(n, seed)
    return MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))


def noisy(matrix, sigma, seed):
    upper = sp.triu(matrix, 1).tocoo()
    stored = np.abs(upper.data) > 1e-12
    upper.data[stored] += sigma * np.random.default_rng(seed).standard_normal(int(stored.sum()))
    return (upper + upper.T).tocsr()


def known_of(element):
    return assembled(element, triangles() if element == "P2" else quadrilaterals(7, 6), zeros=False)


@pytest.mark.parametrize("element", ["P2", "Q1"])
def test_errors_are_as_large_as_the_bars_say(element):
    known = known_of(element)
    bars = recover(noisy(known.matrix, SIGMA, 99), noise=SIGMA, standard_deviations=True).standard_deviations
    ratios, statistics = [], []
    for seed in range(12):
        found = recover(noisy(known.matrix, SIGMA, seed), noise=SIGMA)
        assert found.status == "certified", found.reason
        assert cell_sets(found) == known.cells
        ratios.append(np.sum(np.abs(errors(found.points, known.points)) ** 2) / np.sum(bars**2))
        statistics.append(found.chi_square["statistic"] / found.chi_square["degrees_of_freedom"])
    assert np.sqrt(np.mean(ratios)) == pytest.approx(1, abs=0.25)
    assert np.mean(statistics) == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("element", ["P2", "Q1"])
def test_errors_of_rounded_entries_are_as_large_as_the_bars_say(element):
    known, ratios = known_of(element), []
    for c in np.random.default_rng(0).uniform(1, 10, 12):
        matrix = c * known.matrix
        matrix.data = np.array([float(f"{value:.5e}") for value in matrix.data])
        found = recover(matrix, standard_deviations=True)
        assert found.status == "certified", found.reason
        ratios.append(np.sum(np.abs(errors(found.points, known.points)) ** 2) / np.sum(found.standard_deviations**2))
    assert np.sqrt(np.mean(ratios)) == pytest.approx(1, abs=0.25)


def errors(found, true):
    """What the best similarity, mirrored or not, leaves, in the frame of what was found."""
    z = found @ [1, 1j]
    left = []
    for w in (true @ [1, 1j], true @ [1, -1j]):
        w = w - w.mean()
        left.append(np.vdot(w, z) / np.vdot(w, w) * w - z)
    return min(left, key=lambda one: np.abs(one).max())


@pytest.mark.parametrize("element", ["P2", "Q1"])
def test_noise_ten_times_as_large_as_told_is_noticed(element):
    known = known_of(element)
    assert recover(noisy(known.matrix, 10 * SIGMA, 0), noise=SIGMA).status == "uncertified"


@pytest.mark.parametrize("digits", [6, 9])
@pytest.mark.parametrize("element", ["P2", "Q1"])
def test_rounded_entries(element, digits):
    known = known_of(element)
    matrix = known.matrix.tocsr(copy=True)
    matrix.data = np.array([float(f"{value:.{digits - 1}e}") for value in matrix.data])
    found = recover(matrix)
    assert found.status == "certified", found.reason
    assert cell_sets(found) == known.cells
    assert found.chi_square is not None


@pytest.mark.parametrize("row", [0, 27])
@pytest.mark.parametrize("element", ["P1", "P2", "S2"])
def test_a_row_of_zeros_among_rounded_entries(element, row):
    """It shows no rounding, and is not taken for infinitely exact."""
    known = assembled(element, quadrilaterals(3, 3) if element == "S2" else triangles(40), zeros=False)
    upper = sp.triu(known.matrix, 1).tocoo()
    values = np.array([float(f"{value:.5e}") for value in upper.data])
    values[(upper.row == row) | (upper.col == row)] = 0
    i, j = np.r_[upper.row, upper.col], np.r_[upper.col, upper.row]
    try:
        found = recover(sp.coo_array((np.r_[values, values], (i, j)), shape=upper.shape))
    except RecoveryError:
        return
    assert not found.certified
