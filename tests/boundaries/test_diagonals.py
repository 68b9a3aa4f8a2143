"""Rows that do not add up to zero though nothing was eliminated."""

import numpy as np
import pytest
import scipy.sparse as sp
from pyamg.gallery import poisson

from families import FAMILIES
from meshes import largest_error, random_mesh, specimen
from unassemble import RecoveryError, recover
from vanishing import forgotten, squares


def boundary_rows(triangles):
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    sides, count = np.unique(sides, axis=0, return_counts=True)
    return np.unique(sides[count == 1])


def with_diagonal(known):
    """The matrix with numbers of the size of other entries on the diagonal of all boundary rows."""
    boundary = boundary_rows(known.triangles)
    added = np.zeros(len(known.points))
    added[boundary] = np.random.default_rng(0).uniform(0.5, 2, len(boundary))
    return sp.csr_array(known.matrix + sp.diags_array(added)), boundary


@pytest.mark.parametrize(
    "make",
    [
        lambda: squares(np.ones((12, 9), bool)),
        lambda: random_mesh(150, seed=2),
        # The first reading of these is wrong, though its boundary is right.
        lambda: FAMILIES["kites"](np.random.default_rng(0)),
        lambda: FAMILIES["stairs"](np.random.default_rng(1)),
    ],
)
def test_a_diagonal_on_the_boundary_is_no_elimination(make):
    """As penalties and boundary terms add."""
    known = forgotten(specimen(*make(), c=1.0))
    found = recover(with_diagonal(known)[0])
    assert found.certified, found.reason
    assert largest_error(found.points, known.points) <= 1e-10


def test_a_scale_that_does_not_fit():
    """Nothing is said to fit the others then."""
    order = np.random.default_rng(3).permutation(120)
    matrix = sp.csr_array(poisson((12, 10), format="csr"))[order][:, order]
    assert recover(matrix, scale=1.0).certified
    try:
        found = recover(matrix, scale=2.0)
    except RecoveryError:
        return
    assert not found.certified
