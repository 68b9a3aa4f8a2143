"""Factors c of pieces that share vertices, with errors in the entries."""

from itertools import pairwise

import numpy as np
import pytest
import scipy.sparse as sp

from meshes import random_mesh, specimen, triangle_set
from unassemble import recover

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


def test_loose_pieces_prove_too_little_under_noise():
    """Of each of five the triangle in the middle may be a hole, and that it is none has to be told by itself."""
    known = specimen(*with_rings(5, 0, filled=True), c=C, seed=3)
    found = recover(noisy(known.matrix, 1e-9 * C, 1), noise=1e-9 * C)
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
    assert found.status == "uncertified"
    assert "too few entries to tell" in found.reason


@pytest.mark.parametrize("sigma", [1e-9, 1e-5])
def test_large_pieces_that_share_a_vertex_are_fitted_with_one_factor(sigma):
    one, other = random_mesh(60, 1), random_mesh(60, 2)
    at = int(np.argmax(one[0][:, 0])), int(np.argmin(other[0][:, 0]))
    number = np.r_[len(one[0]) + np.arange(at[1]), at[0], len(one[0]) + np.arange(at[1], len(other[0]) - 1)]
    moved = np.delete(other[0] - other[0][at[1]] + one[0][at[0]] + [0, 0], at[1], axis=0)
    known = specimen(np.vstack([one[0], moved]), np.vstack([one[1], number[other[1]]]), c=C, seed=3)
    found = recover(noisy(known.matrix, sigma * C, 1), noise=sigma * C)
    assert found.certified, found.reason
    assert len(found.scale) == 2
    assert np.ptp(found.scale) == 0
