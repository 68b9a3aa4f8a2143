"""Pieces all of which fit with another factor c, too."""

import numpy as np
import pytest
import scipy.sparse as sp

from meshes import specimen, triangle_set
from unassemble import recover
from unassemble.cells.alternatives import other_scales
from unassemble.cells.alternatives.exhaustion import all_readings
from vanishing import forgotten, squares


def ring_of_right_triangles(count, seed, first=None):
    """Right triangles hinged at the ends of their longest sides, outside of a regular polygon; one may be another."""
    rng = np.random.default_rng(seed)
    corner = np.exp(2j * np.pi * np.arange(count) / count)
    following = np.roll(corner, -1)
    middle, half = (corner + following) / 2, (corner - following) / 2
    apex = middle + half * np.exp(1j * rng.uniform(0.5, np.pi - 0.5, count))
    if first is not None:
        apex[0] = middle[0] + half[0] * first
    z = np.concatenate([corner, apex])
    k = np.arange(count)
    return np.column_stack([z.real, z.imag]), np.column_stack([k, count + k, (k + 1) % count])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("count", "first"), [(3, None), (4, None), (3, 0.2 + 0.6j), (30, None)])
def test_rings_of_right_triangles_are_undivided_polygons_as_well(count, first, seed):
    known = forgotten(specimen(*ring_of_right_triangles(count, seed, first), c=-2.5, seed=seed))
    found = recover(known.matrix)
    assert not found.certified
    if count < 5:
        assert any(not other.same_scale for other in found.alternatives)
    given = recover(known.matrix, scale=-2.5)
    assert not given.certified or len(given.triangles) == count


@pytest.mark.parametrize("seed", range(3))
def test_one_undivided_polygon(seed):
    """Random entries are those of one polygon only, but of long ones that takes too many trials to be certain."""
    rng = np.random.default_rng(seed)
    for n in (5, 40):
        i, j = rng.permutation(n), np.empty(n, dtype=np.int64)
        j[:] = np.roll(i, 1)
        w = rng.uniform(0.5, 2, n)
        found = recover(sp.coo_array((np.r_[-w, -w], (np.r_[i, j], np.r_[j, i])), shape=(n, n)))
        assert found.certified == (n == 5), found.reason
        assert not found.alternatives
        assert found.n_polygons == 1
        assert found.certified or "could be tried" in found.reason


def rhombi(count, seed):
    """Crossed rhombi of any shapes, each hung on a corner of the last; opposite legs are equal."""
    t = np.random.default_rng(seed).uniform(0.5, 2, count)
    hub = 1 + 4 * np.arange(count)
    ends = np.column_stack([np.append(0, hub[:-1] + 2), hub + 1, hub + 2, hub + 3])
    i, j = np.repeat(hub, 4), ends.ravel()
    w = np.column_stack([t, 1 / t, t, 1 / t]).ravel()
    n = 4 * count + 1
    return sp.coo_array((np.r_[-w, -w], (np.r_[i, j], np.r_[j, i])), shape=(n, n)).tocsr()


@pytest.mark.parametrize("count", [2, 5, 16])
def test_rhombi_are_pairs_of_right_triangles_as_well(count):
    matrix = rhombi(count, seed=1)
    found = recover(matrix)
    assert not found.certified
    assert any(not other.same_scale for other in found.alternatives)


def test_many_separate_rectangles_are_all_tried():
    rng = np.random.default_rng(0)
    points, triangles = squares(np.ones((1, 1), bool))
    parts = [(points * [1, rng.uniform(0.5, 2)] + [3 * k, 0], triangles + 4 * k) for k in range(110)]
    known = forgotten(specimen(*map(np.concatenate, zip(*parts, strict=True)), c=-2.5))
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert len(found.polygons_offsets) - 1 == 110


def test_pieces_that_are_alike_are_read_once(monkeypatch):
    """Twelve strips of three squares, which all fit in so many ways that not all can be tried."""
    calls = []

    def counted(part, *arguments):
        calls.append(len(part.vertices))
        return all_readings(part, *arguments)

    monkeypatch.setattr(other_scales, "all_readings", counted)
    points, triangles = squares(np.ones((1, 3), bool))
    copies = [(points + [0, 10 * k], triangles + k * len(points)) for k in range(12)]
    known = forgotten(specimen(*map(np.concatenate, zip(*copies, strict=True)), seed=4))
    found = recover(known.matrix)
    assert not found.certified
    assert 1 <= len(calls) <= 3  # rounding may tell some apart


@pytest.mark.parametrize("corner", [(0.6, -0.7), (0.5, -np.sqrt(0.75)), (1.1, -0.4)])
@pytest.mark.parametrize("filled", [True, False])
def test_congruent_triangles_that_share_a_vertex_may_have_a_right_angle_between_them(corner, filled):
    """By symmetry both have the same entries, and so the same c, in either mesh."""
    x, y = corner
    points = np.array([[0, 0], [1, 0], [x, y], [0, 1], [y, x]])
    triangles = np.array([[0, 2, 1], [0, 3, 4], [0, 1, 3]][: 3 if filled else 2])
    known = forgotten(specimen(points, triangles, seed=5))
    found = recover(known.matrix)
    assert found.status == "ambiguous"
    assert len(found.alternatives) == 1
    assert "so does another" in found.reason
    told = recover(known.matrix, scale=1.0)
    assert told.certified, told.reason
    assert triangle_set(told.triangles) == triangle_set(known.triangles)


def test_stored_zeros_are_no_doubles_of_others():
    """A ring of six edges, one of them with a stored zero."""
    edges = np.array([[0, 1], [0, 5], [1, 2], [2, 3], [3, 4], [4, 5]])
    with np.errstate(all="raise"):
        other_scales._of_tiles(6, edges, np.array([1.0, 2.0, 0.0, 1.0, 2.0, 1.0]))


LOOK_LIKE_TWO = {
    "root of three": ([[2, 0], [3, 0], [0, 0], [1, 1], [0, 1]], [[0, 3, 2], [2, 3, 4], [3, 0, 1]]),
    "root of five": ([[2, 0], [2, 2], [0, 1], [1, 2], [1, 1]], [[0, 4, 2], [3, 4, 1], [4, 3, 2], [4, 0, 1]]),
    "root of 8/3": ([[2, 3], [3, 0], [0, 0], [1, 1], [0, 2]], [[0, 3, 1], [3, 2, 1], [3, 0, 4]]),
}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", LOOK_LIKE_TWO)
def test_one_piece_that_looks_like_two_triangles_with_one_factor(name, seed):
    """Their sides have vanished from the boundary, and what is left are two triangles that share a vertex."""
    points, triangles = LOOK_LIKE_TWO[name]
    known = forgotten(specimen(np.array(points, dtype=float), np.array(triangles), c=1.7, seed=seed))
    found = recover(known.matrix)
    assert found.backward_error < 1e-12
    assert found.status == "ambiguous"
    assert any(not other.same_scale and other.tested for other in found.alternatives)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("count", [1, 4])
def test_loose_pieces_that_share_a_vertex_are_one_piece_as_well(count, seed):
    """A triangle, or a strip of some, on each side of a vertex: with c known they are what they seem to be."""
    rng = np.random.default_rng(seed)
    strip = np.column_stack([np.arange(count + 2) / 2 + 1, np.arange(count + 2) % 2])
    strip = (strip - strip[0]) @ [[1, 0], [0.2, 1]] + rng.uniform(-0.1, 0.1, strip.shape) * (np.arange(count + 2) > 0)[
        :, None
    ]
    own = np.arange(count)[:, None] + np.arange(3)
    points = np.vstack([strip, -strip[1:] * [1.3, 0.7]])
    other = np.where(own == 0, 0, own + count + 1)
    known = specimen(points, np.vstack([own, other]), c=-2.5, seed=seed)
    found = recover(known.matrix)
    assert len(found.hinges) == 1
    assert found.status == "ambiguous"
    assert all(other.other_cells and not other.cells for other in found.alternatives)
    assert found.alternatives[0].tested
    given = recover(known.matrix, scale=-2.5)
    assert given.certified, given.reason
    assert triangle_set(given.triangles) == triangle_set(known.triangles)
