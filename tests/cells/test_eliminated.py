"""Matrices whose boundary unknowns were eliminated: entries next to them still contain cells that are gone."""

import numpy as np
import pytest
import scipy.sparse as sp
from pyamg.gallery import poisson

from families import FAMILIES
from meshes import SHARED, largest_error, needs_shared, random_mesh, specimen
from unassemble import recover
from vanishing import forgotten, squares

NOTE = "unknowns that were eliminated"


def without_boundary(known):
    """The matrix without boundary rows, the points, and which are two edges from the new boundary and more."""
    inside = np.setdiff1d(np.arange(len(known.points)), boundary_rows(known.triangles))
    matrix = sp.csr_array(known.matrix[inside][:, inside])
    near = np.setdiff1d(np.arange(len(known.points)), inside)
    for _ in range(3):  # the first are those of the new boundary
        near = np.unique(known.triangles[np.isin(known.triangles, near).any(axis=1)])
    return matrix, known.points[inside], ~np.isin(inside, near)


@pytest.mark.parametrize("holes", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_irregular_meshes_are_right_inside(seed, holes):
    """What entries next to the boundary lack has no part in the fit, and nothing else is searched for."""
    matrix, points, deep = without_boundary(specimen(*random_mesh(1500, seed=seed, holes=holes), c=-2.5, seed=seed))
    found = recover(matrix)
    assert not found.certified
    assert NOTE in found.reason
    assert largest_error(found.points[deep], points[deep]) <= 1e-6
    assert found.scale == pytest.approx(-2.5, rel=1e-6)


@needs_shared
@pytest.mark.parametrize("name", ["pyamg_unit_square", "skfem_backward_facing_step", "thetis_headland"])
def test_third_party_meshes_are_right_inside(name):
    mesh = np.load(SHARED / "corpus" / "planar" / f"{name}.npz")
    matrix, points, deep = without_boundary(specimen(mesh["points"], mesh["triangles"].astype(np.int64), c=7.0))
    found = recover(matrix)
    assert NOTE in found.reason
    assert largest_error(found.points[deep], points[deep]) <= 1e-6


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
    found = recover(matrix, scale=2.0)
    assert not found.certified
    assert "all others fit" not in " ".join([found.reason, *found.warnings])
