"""Entries that were rounded show to what they were: the fit weighs them so, and the test needs no noise to be given."""

import numpy as np
import pytest
import scipy.sparse as sp

from meshes import delaunay, largest_error, random_mesh, specimen
from unassemble import recover
from unassemble.tolerances import SUSPICIOUS
from vanishing import forgotten, half_jittered, holes, squares


def rounded(matrix, form):
    """Entries printed in that form and read again."""
    entries = sp.coo_array(matrix)
    data = entries.data.astype(np.float32).astype(float)
    if form != "single":
        data = np.array([float(form % value) for value in entries.data.tolist()])
    return sp.coo_array((data, (entries.row, entries.col)), shape=entries.shape)


NAMES = {"single": "single precision", "%.6g": "6 digits", "%.4g": "4 digits", "%.3g": "3 digits", "%.6f": "6 decimals"}


@pytest.mark.slow
@pytest.mark.parametrize("form", NAMES)
def test_rounded_entries_are_tested_against_their_rounding(form):
    known = specimen(*random_mesh(400, seed=1), c=1.7)
    found = recover(rounded(known.matrix, form), standard_deviations=True)
    assert found.certified, found.reason
    assert found.reason.startswith(f"rounding to {NAMES[form]} explains the misfit")
    assert found.chi_square["p_value"] > 1e-3
    # Errors are correlated, so that a single draw strays; but not by a factor of five.
    true = found.points @ [1, 1j]
    size = np.linalg.norm(true - true.mean()) / np.linalg.norm(known.points)
    expected = np.linalg.norm(found.standard_deviations) / size / np.sqrt(len(true))
    error = largest_error(found.points, known.points) * np.ptp(known.points)
    assert 0.2 * expected < error < 10 * expected


@pytest.mark.slow
def test_errors_relative_to_the_entries_are_weighed_so():
    """Weights of random points differ by orders of magnitude: with one sigma for all the mesh is worse."""
    errors, uniform = [], []
    for seed in range(8):
        known = specimen(*delaunay(np.random.default_rng(seed).random((150, 2))), seed=seed)
        matrix = rounded(known.matrix, "%.6g")
        found = recover(matrix)
        assert found.certified, found.reason
        errors.append(largest_error(found.points, known.points))
        largest = np.abs(matrix.data[matrix.row != matrix.col]).max()
        sigma = 0.5 * 10.0 ** (np.floor(np.log10(largest)) - 5) / np.sqrt(3)
        uniform.append(largest_error(recover(matrix, noise=sigma).points, known.points))
    assert np.mean(np.log(uniform)) > np.mean(np.log(errors)) + np.log(1.2)


@pytest.mark.parametrize("mesh", [squares(holes(10, 8), width=3.0), half_jittered(8)], ids=["rectangles", "half"])
def test_equal_entries_have_equal_errors(mesh):
    known = forgotten(specimen(*mesh, c=1.7))
    found = recover(rounded(known.matrix, "%.6g"))
    assert found.certified, found.reason
    assert found.chi_square["degrees_of_freedom"] < 5
    assert largest_error(found.points, known.points) < 1e-5


def test_too_few_different_entries_prove_nothing():
    found = recover(rounded(forgotten(specimen(*squares(holes(6, 5), width=3.0), c=1.7)).matrix, "%.3g"))
    assert found.status == "uncertified"
    assert "too few different entries" in found.reason


@pytest.mark.parametrize("c", [1.0, 0.25, 3.0, 1.234567])
def test_exact_entries_of_few_digits_are_not_taken_for_rounded(c):
    """Five-point stencils, their entries whole numbers or not."""
    for known in (specimen(*squares(holes(12, 9)), c=c), forgotten(specimen(*squares(holes(12, 9)), c=c))):
        entries = known.matrix.tocoo()
        exact = sp.coo_array((np.round(entries.data / c * 2) / 2 * c, (entries.row, entries.col)), entries.shape)
        found = recover(exact)
        assert found.certified, found.reason
        assert "gives the matrix back" in found.reason
        assert (found.chi_square is None) == (c != 1.234567)


def test_whole_entries_of_no_mesh_are_not_excused():
    known = specimen(*random_mesh(100, seed=1))
    entries = known.matrix.tocoo()
    size = np.random.default_rng(0).integers(1, 5, known.matrix.shape)
    whole = -np.maximum(size, size.T)[entries.row, entries.col].astype(float)
    found = recover(sp.coo_array((whole, (entries.row, entries.col)), entries.shape))
    assert found.status == "uncertified"
    assert found.chi_square is None


@pytest.mark.slow
@pytest.mark.parametrize("form", ["single", "%.6g", "%.4g"])
def test_rounding_does_not_excuse_a_wrong_entry(form):
    known = specimen(*random_mesh(400, seed=1))
    i, j = known.triangles[3, :2]
    wrong = sp.lil_array(known.matrix)
    wrong[i, j] = wrong[j, i] = wrong[i, j] * (1.001 if form == "single" else 1.03)
    found = recover(rounded(wrong.tocsr(), form))
    assert found.status == "uncertified"
    assert "explains the misfit" not in found.reason
    assert {int(i), int(j)} == set(found.worst_entries[0])


def test_other_errors_are_estimated_though_entries_are_rounded():
    known, sigma = specimen(*random_mesh(400, seed=1)), 1e-3
    upper = sp.triu(known.matrix, 1).tocoo()
    value = upper.data + sigma * np.random.default_rng(0).standard_normal(upper.nnz)
    ends = np.r_[upper.row, upper.col], np.r_[upper.col, upper.row]
    noisy = rounded(sp.coo_array((np.r_[value, value], ends), shape=known.matrix.shape), "%.6g")
    found, told = recover(noisy), recover(noisy, noise=sigma)
    assert found.status == "uncertified"
    assert "noise of standard deviation" in found.reason
    assert found.estimated_noise == pytest.approx(sigma, rel=0.15)
    assert told.certified, told.reason
    assert largest_error(found.points, told.points) < 0.1 * largest_error(told.points, known.points)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["%.3g", "%.4g", "%.6g"])
def test_weights_of_no_mesh_are_not_certified(form):
    rng = np.random.default_rng(3)
    for seed in range(3):
        known = specimen(*delaunay(rng.random((12, 2))), seed=seed)
        upper = sp.triu(known.matrix, 1).tocoo()
        value = upper.data * (1 + 0.05 * rng.standard_normal(upper.nnz))
        ends = np.r_[upper.row, upper.col], np.r_[upper.col, upper.row]
        found = recover(rounded(sp.coo_array((np.r_[value, value], ends), shape=known.matrix.shape), form))
        if found.chi_square and found.chi_square["degrees_of_freedom"] > 2:
            assert found.status == "uncertified", found.reason


def test_no_entries_are_blamed_for_what_rounding_leaves_beside_slivers():
    """The hull of random points has triangles that are nearly flat: the misfit there is larger than elsewhere."""
    known = specimen(*delaunay(np.random.default_rng(3).random((20_000, 2))))
    found = recover(known.matrix)
    assert found.certified
    assert found.backward_error > SUSPICIOUS
