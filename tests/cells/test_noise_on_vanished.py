"""Noise, rounding and leftovers of assembly on matrices that do not store their zeros, or some of them."""

import numpy as np
import pytest
import scipy.sparse as sp

from families import FAMILIES
from meshes import largest_error, specimen
from unassemble import recover
from vanishing import forgotten, half_jittered, holes, polar, refined, squares, triangular_holes

MESHES = {  # and the numbers of triangles, polygons and holes
    "five-point stencil": (squares(holes(12, 9)), 0, 108, 0),
    "L-shape": (squares(holes(10, 10, (5, 5, 5, 5))), 0, 75, 0),
    "rectangles": (squares(holes(10, 8), width=3.0), 0, 80, 0),
    "crossed squares": (squares(holes(9, 9), crossed=True), 36, 144, 0),
    "crossed squares with holes": (squares(holes(9, 8, (3, 3, 1, 1), (5, 4, 2, 2)), crossed=True), 46, 111, 2),
    "grid with holes": (squares(holes(16, 16, (3, 3, 4, 5), (10, 10, 2, 1), (8, 2, 1, 2))), 0, 232, 3),
    "annulus": (polar(4, 12, 0.5), 0, 48, 1),
    "adaptive": (refined(4, 1), 86, 43, 0),
    "triangles and squares": (half_jittered(10), 100, 50, 0),
}
C = 1.7


def upper_with(matrix, change):
    """The matrix with the entries above the diagonal, and those below, changed alike."""
    upper = sp.triu(matrix, 1).tocoo()
    value = change(upper.data)
    ends = np.r_[upper.row, upper.col], np.r_[upper.col, upper.row]
    return sp.coo_array((np.r_[value, value], ends), shape=matrix.shape)


def noisy(matrix, sigma, seed=0):
    return upper_with(matrix, lambda data: data + sigma * np.random.default_rng(seed).standard_normal(len(data)))


def six_digits(matrix):
    return upper_with(matrix, lambda data: np.array([float(f"{value:.6g}") for value in data.tolist()]))


def leftovers(matrix, seed=0):
    """What should vanish is stored, as 1e-17 to 1e-12."""

    def change(data):
        rng = np.random.default_rng(seed)
        small = rng.choice([-1, 1], len(data)) * 10.0 ** rng.uniform(-17, -12, len(data))
        return np.where(np.abs(data) < 1e-12, small, data)

    return upper_with(matrix, change)


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("sigma", [1e-9, 1e-5, 1e-3])
def test_noise_on_what_is_stored(name, sigma):
    mesh, *counts = MESHES[name]
    known = forgotten(specimen(*mesh, c=C, seed=3))
    found = recover(noisy(known.matrix, sigma), noise=sigma)
    assert found.status == "certified", found.reason
    assert [len(found.triangles), found.n_polygons, found.n_holes] == counts
    assert largest_error(found.points, known.points) < 6 * sigma
    # Entries that have vanished have no errors, and are fitted as such.
    assert found.estimated_noise == pytest.approx(sigma, rel=0.3)


@pytest.mark.parametrize("name", ["five-point stencil", "crossed squares", "adaptive"])
def test_noise_on_stored_zeros_too(name):
    """Then there is nothing to be read: the graph has all its triangles."""
    mesh, *_ = MESHES[name]
    known = specimen(*mesh, c=C, seed=3)
    found = recover(noisy(known.matrix, 1e-6), noise=1e-6)
    assert found.certified, found.reason
    assert found.n_polygons == 0
    assert len(found.triangles) == len(known.triangles)
    assert largest_error(found.points, known.points) < 6e-6


@pytest.mark.parametrize(
    "name", ["five-point stencil", "crossed squares with holes", "annulus", "triangles and squares"]
)
def test_six_digits(name):
    mesh, *counts = MESHES[name]
    known = forgotten(specimen(*mesh, c=C, seed=3))
    rounded = six_digits(known.matrix)
    found, told = recover(rounded), recover(rounded, noise=5e-6)
    for one in (found, told):
        assert [len(one.triangles), one.n_polygons, one.n_holes] == counts
        assert largest_error(one.points, known.points) < 1e-5
        assert one.certified, one.reason


@pytest.mark.parametrize("name", ["five-point stencil", "crossed squares", "adaptive", "triangles and squares"])
def test_rounded_entries_and_leftovers_in_place_of_zeros(name):
    mesh, *counts = MESHES[name]
    known = specimen(*mesh, c=C, seed=3)
    matrix = six_digits(leftovers(known.matrix))
    kept = recover(matrix, noise=5e-6)  # stored, so structure
    assert kept.certified, kept.reason
    assert len(kept.triangles) == len(known.triangles)
    dropped = recover(matrix, noise=5e-6, drop_zeros=1e-11)
    assert dropped.certified, dropped.reason
    assert [len(dropped.triangles), dropped.n_polygons, dropped.n_holes] == counts
    for found in (kept, dropped):
        assert largest_error(found.points, known.points) < 1e-5


def test_holes_of_three_edges_under_noise():
    known = specimen(*triangular_holes(300, 5), c=C)
    found = recover(noisy(known.matrix, 1e-5), noise=1e-5)
    assert found.certified, found.reason
    assert found.n_holes == 5
    assert largest_error(found.points, known.points) < 6e-5


def test_more_noise_than_is_said_is_not_certified():
    mesh, *_ = MESHES["grid with holes"]
    known = forgotten(specimen(*mesh, c=C, seed=3))
    found = recover(noisy(known.matrix, 2e-3), noise=5e-4)
    assert found.status == "uncertified"
    assert "more than noise" in found.reason


def test_equal_entries_with_noise_are_no_evidence_either():
    """Squares and halves of squares have one c wherever they are put."""
    known = forgotten(specimen(*FAMILIES["crossed"](np.random.default_rng(5)), c=C))
    for sigma in (1e-8, 1e-5):
        assert not recover(noisy(known.matrix, sigma), noise=sigma).certified


@pytest.mark.slow
@pytest.mark.parametrize(("family", "seed"), [("stairs", 1), ("cut_cells", 6)])
def test_a_cell_that_the_noise_hides_is_named(family, seed):
    """Of some 170 rows: another triangle next to the boundary makes no more difference than the noise."""
    known = forgotten(specimen(*FAMILIES[family](np.random.default_rng(seed)), c=C, seed=seed))
    truth, found = recover(known.matrix), recover(noisy(known.matrix, 2e-3), noise=2e-3)
    right = set(map(frozenset, cells_of(truth))) == set(map(frozenset, cells_of(found)))
    assert not found.certified or right


def cells_of(found):
    ends = zip(found.polygons_offsets[:-1], found.polygons_offsets[1:], strict=True)
    return [*map(tuple, found.triangles.tolist()), *(tuple(found.polygons_data[a:b].tolist()) for a, b in ends)]
