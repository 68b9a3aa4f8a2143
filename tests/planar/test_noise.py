"""Noisy entries: the maximum-likelihood mesh, its error bars, the tests that it has to pass."""

import numpy as np
import pytest
import scipy.sparse as sp
from arithmetic import perturbed

from meshes import delaunay, diameter, largest_error, random_mesh, specimen
from unassemble import GeometryError, recover
from unassemble.matrix import check_matrix
from unassemble.planar import CAREFUL, PolishOptions, conformal_map, count_flipped, polish
from unassemble.topology import surfaces


def noisy(matrix, sigma, seed=0):
    """Independent normal errors in the upper triangle, the same in the lower one."""
    upper = sp.triu(matrix, 1).tocoo()
    value = upper.data + sigma * np.random.default_rng(seed).standard_normal(upper.nnz)
    ends = np.r_[upper.row, upper.col], np.r_[upper.col, upper.row]
    return sp.coo_array((np.r_[value, value], ends), shape=matrix.shape)


def best_fit(points, true):
    """Complex errors after the best similarity or reflection."""
    source, target = points @ [1, 1j], true @ [1, 1j]
    source, target = source - source.mean(), target - target.mean()
    fits = [s * (np.vdot(s, target) / np.vdot(s, s)) - target for s in (source, source.conj())]
    return min(fits, key=np.linalg.norm)


def weights(z, triangles, edges):
    """Cotangent weights of pairs i < j, from dot and cross products."""
    n = len(z)
    result = np.zeros(len(edges))
    key = edges[:, 0] * n + edges[:, 1]
    for k in range(3):
        c, a, b = (triangles[:, (k + s) % 3] for s in range(3))
        product = (z[a] - z[c]).conj() * (z[b] - z[c])
        place = np.searchsorted(key, np.minimum(a, b) * n + np.maximum(a, b))
        np.add.at(result, place, product.real / np.abs(product.imag) / 2)
    return result


def response(known, c=None):
    """Dense matrix (2 v, e) from errors of the entries to the displacement of the best linear estimate.

    By the pseudo-inverse of the weights' derivative, formed by central differences, with a fitted scale projected out.
    """
    z = known.points @ [1, 1j]
    upper = sp.triu(known.matrix, 1).tocsr()
    upper.sort_indices()
    edges = np.column_stack(upper.tocoo().coords)
    step, columns = 1e-6 * diameter(known.points), []
    for k in range(len(z)):
        for unit in (1, 1j):
            move = np.zeros(len(z), complex)
            move[k] = step * unit
            ends = [weights(z + s * move, known.triangles, edges) for s in (1, -1)]
            columns.append((ends[0] - ends[1]) / (2 * step))
    derivative = np.column_stack(columns)
    if c is None:
        w = weights(z, known.triangles, edges)
        derivative -= np.outer(w, w @ derivative) / (w @ w)
    return -np.linalg.pinv(derivative, rcond=1e-7)


@pytest.fixture(scope="module")
def small():
    known = specimen(*random_mesh(170, seed=3))
    return known, response(known)


@pytest.mark.parametrize("sigma", [1e-12, pytest.param(1e-3, marks=pytest.mark.slow)])
def test_mean_square_error_is_that_of_the_cramer_rao_bound(small, sigma):
    """100 draws; the null vector beside it. Both sums are over the same draws, and over their expectation."""
    known, linear = small
    v, edges = len(known.points), linear.shape[1]
    bound = sigma**2 * np.sum(linear**2) / v
    polished, unpolished, first_order = [], [], []
    for seed in range(100):
        found = recover(noisy(known.matrix, sigma, seed), noise=sigma, threads=1)
        polished.append(np.mean(np.abs(best_fit(found.points, known.points)) ** 2))
        error = sigma * np.random.default_rng(seed).standard_normal(edges)
        first_order.append(np.sum((linear @ error) ** 2) / v)
        if seed < 10:
            start = recover(noisy(known.matrix, sigma, seed), noise=sigma, refine=False)
            unpolished.append(np.mean(np.abs(best_fit(start.points, known.points)) ** 2))
    assert np.mean(polished) < 1.1 * bound
    assert np.mean(polished) == pytest.approx(np.mean(first_order), rel=0.01)
    assert np.mean(unpolished) > 3 * bound


def test_error_bars_are_those_of_the_bound(small):
    known, linear = small
    sigma = 1e-5
    found = recover(noisy(known.matrix, sigma), noise=sigma, standard_deviations=True)
    # In the frame of the true mesh, in which errors are compared: size and rotation as fitted.
    expected = sigma * np.sqrt(np.sum(linear.reshape(len(known.points), 2, -1) ** 2, axis=(1, 2)))
    size = np.abs(known.points - known.points.mean(0)).std() / np.abs(found.points).std()
    ratio = np.linalg.norm(known.points - known.points.mean(0)) / np.linalg.norm(found.points)
    assert size == pytest.approx(ratio, rel=0.2)
    assert np.linalg.norm(found.standard_deviations, axis=1) * ratio == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("sigma", [1e-9, 1e-6, 1e-3])
def test_noise_is_estimated_where_it_is_not_given(small, sigma):
    known, _ = small
    matrix = noisy(known.matrix, sigma)
    found, told = recover(matrix, standard_deviations=True), recover(matrix, noise=sigma, standard_deviations=True)
    assert found.status == "uncertified"
    assert found.estimated_noise == pytest.approx(sigma, rel=0.15)
    assert found.report()["estimated_noise"] == found.estimated_noise
    assert "noise of standard deviation" in found.reason
    # The same mesh: errors of one size are recognised as such.
    assert np.abs(best_fit(found.points, told.points)).max() < 0.05 * told.standard_deviations.max()
    assert np.median(found.standard_deviations / told.standard_deviations) == pytest.approx(
        found.estimated_noise / sigma, rel=0.05
    )


def test_noise_that_drowns_everything_certifies_nothing():
    known = specimen(*random_mesh(300, seed=2), c=-4.0)
    found = recover(noisy(known.matrix, 0.21), noise=0.21)
    assert found.status == "uncertified"
    assert "drowns" in found.reason
    assert recover(known.matrix, noise=0.8).certified  # an exact fit needs no test
    assert any("generous" in warning for warning in recover(known.matrix, noise=0.1).warnings)


def channel(length, width):
    """Forty times as long as wide: noise makes large errors of smooth conformal maps, and the start is far off."""
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.arange(length), np.arange(width))
    points = np.column_stack([(x + 0.5 * (y % 2)).ravel(), 0.87 * y.ravel()]) + rng.uniform(-0.25, 0.25, (x.size, 2))
    return specimen(*delaunay(points, longest=2.0))


def test_start_far_off_is_polished_to_the_same_mesh_as_the_truth():
    known, sigma = channel(200, 5), 1e-2
    checked = check_matrix(noisy(known.matrix, sigma), noise=sigma)
    piece = surfaces(checked.n, checked.edges).pieces[0]
    entries = -checked.entries[piece.edge_rows]
    start = conformal_map(piece, entries, sharp=False)
    chord, careful = polish(piece, entries, start.z), polish(piece, entries, start.z, options=CAREFUL)
    truth = polish(piece, entries, known.points[piece.vertices] @ [1, 1j], options=CAREFUL)
    assert not chord.converged
    assert careful.converged
    assert careful.residual == pytest.approx(truth.residual, rel=1e-6)
    assert careful.residual < 0.5 * chord.residual
    assert recover(noisy(known.matrix, sigma), noise=sigma).certified


@pytest.mark.slow
def test_noise_that_lets_points_coincide_leaves_no_mesh():
    known, sigma = channel(200, 5), 2e-2
    matrix = noisy(known.matrix, sigma, seed=4)
    with pytest.raises(GeometryError, match=r"coincide in the nearest one\. No polish: "):
        recover(matrix, noise=sigma)
    with pytest.raises(GeometryError, match="points coincide"):
        recover(matrix, noise=sigma, refine=False)


def test_a_mesh_that_was_not_polished_says_so():
    known = specimen(*random_mesh(300, seed=2))
    found = recover(noisy(known.matrix, 1e-3), noise=5e-4, refine=False)
    assert found.status == "uncertified"
    assert "was not polished" in found.reason


def test_misfit_that_is_no_fault_of_the_polish_is_not_told_from_one():
    known = specimen(*random_mesh(300, seed=2))
    found = recover(noisy(known.matrix, 1e-3), noise=5e-4)
    assert found.status == "uncertified"
    assert "The polish has not come to a mesh that explains the matrix" in found.reason
    assert "cannot be told" in found.reason


def test_triangles_turned_over_are_counted():
    known = specimen(*random_mesh(200, seed=5))
    checked = check_matrix(known.matrix)
    piece = surfaces(checked.n, checked.edges).pieces[0]
    z = known.points[piece.vertices] @ [1, 1j]
    assert count_flipped(piece, z) == count_flipped(piece, z.conj()) == 0
    inner = np.setdiff1d(np.arange(len(z)), piece.boundary)[0]
    z[inner] += diameter(known.points)
    assert count_flipped(piece, z) >= 1


def test_rings_of_very_different_loops_are_not_hidden_by_their_inversion():
    """The map 1/z of a ring has a quotient close to that of the ring itself."""
    around, across, ratio = 60, 66, 1000.0
    rng = np.random.default_rng(0)
    i, j = np.meshgrid(np.arange(around), np.arange(across))
    i, j = i + 0.5 * (j % 2) + rng.uniform(-0.2, 0.2, i.shape), j + rng.uniform(-0.2, 0.2, j.shape)
    z = (ratio ** (-j / across) * np.exp(2j * np.pi * i / around)).ravel()
    points, triangles = delaunay(np.column_stack([z.real, z.imag]))
    middle = np.linalg.norm(points[triangles].mean(axis=1), axis=1)
    used, triangles = np.unique(triangles[middle > 1.5 / ratio], return_inverse=True)
    found = recover((known := specimen(points[used], triangles.reshape(-1, 3), c=7.0)).matrix)
    assert found.certified, found.reason
    assert largest_error(found.points, known.points) < 1e-10


@pytest.mark.arithmetic
@pytest.mark.fallback
@pytest.mark.parametrize("last_bits", range(2))
def test_normal_equations_without_a_digit_left_spoil_no_polish(last_bits):
    """Four hundred times as long as wide: how the factor of J'J is off depends on the order of sums, the mesh does not.

    Each of the entries is moved by a unit in the last place besides, in the second run.
    """
    known = channel(2000, 5)
    matrix = noisy(known.matrix, 1e-7, seed=3)
    matrix = perturbed(matrix) if last_bits else matrix
    for noise in (1e-3, 1e-6)[last_bits:]:
        found = recover(matrix, noise=noise)
        assert found.certified, found.reason
        assert not any("did not converge" in note for note in found.warnings)
        test = found.chi_square
        assert noise * np.sqrt(test["statistic"] / test["degrees_of_freedom"]) == pytest.approx(1e-7, rel=0.05)
        assert largest_error(found.points, known.points) < 1e-5


@pytest.mark.arithmetic
def test_a_polish_without_end_is_not_certified(monkeypatch):
    """Entries may be explained by a mesh that is far from the likeliest one."""
    monkeypatch.setattr("unassemble.planar.piece.CAREFUL", PolishOptions(careful=True, max_steps=1))
    found = recover(noisy(channel(2000, 5).matrix, 1e-7, seed=3), noise=1e-6)
    assert not found.certified
    assert any("did not converge" in note for note in found.warnings)
