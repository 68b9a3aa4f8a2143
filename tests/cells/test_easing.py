"""Readings put right by angles alone: what looks alike by itself is told by what it leaves to the cells around it."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from domains import cut_to_diagonals
from meshes import largest_error_of_pieces, specimen
from unassemble import recover
from unassemble.cells.candidates.candidates import Candidates
from unassemble.cells.candidates.starts import likely_readings
from unassemble.cells.candidates.strain import eased, strain
from unassemble.cells.reading import Reading
from unassemble.matrix import check_matrix
from unassemble.topology import components
from unassemble.topology.embedding import face_complexes
from vanishing import forgotten, holes, squares, used


def _pixels(k, seed):
    """A square with round holes, whose stairs are cut to diagonals."""
    rng = np.random.default_rng(seed)
    at = np.stack(np.meshgrid(np.arange(k + 1) / k, np.arange(k + 1) / k, indexing="ij"), axis=-1)
    inside = np.ones((k + 1, k + 1), dtype=bool)
    for centre, radius in zip(rng.uniform(0.05, 0.95, (10, 2)), rng.uniform(0.02, 0.08, 10), strict=True):
        inside &= np.linalg.norm(at - centre, axis=-1) > radius
    return used(*cut_to_diagonals(inside))


def _blobs(k, seed):
    """Where a smooth random field is large."""
    field = gaussian_filter(np.random.default_rng(seed).standard_normal((k, k)), k / 12)
    return used(*cut_to_diagonals(field > np.quantile(field, 0.35)))


def _teeth(k, first, last):
    """Ten rows of squares, and half a square below each of some in a row: they could lean to either side."""
    points, triangles = squares(np.ones((k, 10), dtype=bool))
    number = {tuple(point): row for row, point in enumerate(points.tolist())}
    tips = [(float(i), -1.0) for i in range(first, last)]
    more = [(number[i, 0.0], len(points) + j, number[i + 1, 0.0]) for j, (i, _) in enumerate(tips)]
    return np.concatenate([points, tips]), np.concatenate([triangles, more])


def _rectangles(k, seed):
    """A grid of rectangles with holes of one to nine of them."""
    rng = np.random.default_rng(seed)
    corners, sizes = rng.integers(1, k - 4, (30, 2)), rng.integers(1, 4, (30, 2))
    return squares(holes(k, k, *np.column_stack([corners, sizes]).tolist()), width=3)


def _candidates(known):
    """Of the largest component."""
    matrix = check_matrix(known.matrix)
    part = max(components(matrix.n, matrix.edges), key=lambda part: len(part.vertices))
    drawing = next(face_complexes(len(part.vertices), part.edges))
    return Candidates.of(drawing, -matrix.entries[part.edge_rows])


@pytest.mark.parametrize(
    "mesh", [_pixels(20, 4), _pixels(20, 15), _pixels(60, 1), _blobs(60, 4), _teeth(40, 5, 30), _rectangles(40, 1)]
)
def test_strain_leads_to_the_mesh(mesh):
    candidates = _candidates(forgotten(specimen(*mesh, c=-0.7, seed=3)))
    first = next(likely_readings(candidates))
    assert not Reading.of(candidates, first).fits
    labels = eased(candidates, first)
    assert labels is not None
    assert strain(candidates, labels) < strain(candidates, first)
    assert Reading.of(candidates, labels).fits


def test_nothing_is_changed_where_angles_add_up():
    candidates = _candidates(forgotten(specimen(*squares(np.ones((9, 7), dtype=bool)))))
    assert eased(candidates, next(likely_readings(candidates))) is None


@pytest.mark.parametrize("mesh", [_pixels(20, 4), _pixels(60, 2)])
def test_such_meshes_are_certified(mesh):
    known = forgotten(specimen(*mesh, c=3.1, seed=8))
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert largest_error_of_pieces(found, known.points) <= 1e-9
