"""Matrices whose boundary unknowns were eliminated: entries next to them still contain cells that are gone."""

import numpy as np
import pytest
import scipy.sparse as sp
from pyamg.gallery import poisson

from meshes import largest_error, random_mesh, specimen
from unassemble import recover
from vanishing import forgotten, holes, squares


@pytest.mark.parametrize("shape", [(5, 9), (10, 10), (40, 31)])
def test_finite_differences(shape):
    points = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 2).astype(float)
    order = np.random.default_rng(1).permutation(len(points))
    found = recover(sp.csr_array(poisson(shape, format="csr"))[order][:, order])
    assert largest_error(found.points, points[order]) <= 1e-9
    assert len(found.polygons_offsets) - 1 == (shape[0] - 1) * (shape[1] - 1)
    assert not found.certified
    assert "unknowns that were eliminated" in found.reason
    assert len(found.suspects) == 2 * (sum(shape) - 2)


def test_grid_with_holes():
    known = forgotten(specimen(*squares(holes(20, 18, (4, 5, 3, 4), (12, 9, 2, 2))), c=-2.5))
    inside = np.setdiff1d(np.arange(len(known.points)), recover(known.matrix).boundary)
    found = recover(known.matrix[inside][:, inside])
    assert largest_error(found.points, known.points[inside]) <= 1e-9
    assert found.n_holes == 2
    assert "unknowns that were eliminated" in found.reason


@pytest.mark.parametrize("make", [lambda: squares(np.ones((12, 9), bool)), lambda: random_mesh(150, seed=2)])
def test_a_diagonal_on_the_boundary_is_no_elimination(make):
    """As penalties and boundary terms add; here of the size of other entries."""
    known = forgotten(specimen(*make(), c=1.0))
    boundary = np.unique(recover(known.matrix).boundary)
    added = np.zeros(len(known.points))
    added[boundary] = np.random.default_rng(0).uniform(0.5, 2, len(boundary))
    found = recover(known.matrix + sp.diags_array(added))
    assert found.certified, found.reason
    assert largest_error(found.points, known.points) <= 1e-10
