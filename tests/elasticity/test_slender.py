"""Slender bodies, which bend so easily that rounding of the entries shows in the identities."""

import numpy as np
import pytest
from assembled import box, eliminated, error, on_plane, recover_elasticity, stiffness


def beam(kind, length):
    """So many nodes by 3, of about equal distances."""
    return stiffness(kind, box(kind, (length, 3), stretch=(0.53 * length, 1)), lam=1.5)


@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1"])
def test_free_beams(kind):
    case = beam(kind, 1601)
    found = recover_elasticity(case.matrix)
    assert found.certified
    assert found.evidence[0].gap < 1e-5
    assert error(found.points, case.points) < 1e-11


def test_a_beam_clamped_at_one_end():
    case = beam("quad-q1", 801)
    matrix, nodes = eliminated(case, np.repeat(on_plane(case, 0)[:, None], 2, axis=1))
    found = recover_elasticity(matrix)
    assert found.certified
    assert error(found.points, case.points[nodes]) < 1e-11


@pytest.mark.parametrize("cells", [False, True])
def test_beams_in_space(cells):
    case = stiffness("hex-q1", box("hex-q1", (301, 2, 2), stretch=(266, 1, 1)), lam=1.5)
    found = recover_elasticity(case.matrix, cells=cells)
    assert found.certified
    assert error(found.points, case.points) < 1e-11


@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1"])
def test_strips_that_bend_less_easily_are_certified_without_elements(kind):
    case = beam(kind, 301)
    found = recover_elasticity(case.matrix, cells=False)
    assert found.certified
    assert error(found.points, case.points) < 1e-12


@pytest.mark.arithmetic
def test_thin_bodies_lose_few_digits_where_charts_meet():
    case = stiffness("tet-p1", box("tet-p1", (201, 4, 4), stretch=(60, 1, 1)), lam=1.5)
    matrix, nodes = eliminated(case, np.repeat(on_plane(case, 0)[:, None], 3, axis=1))
    found = recover_elasticity(matrix, cells=False)
    assert found.certified
    assert error(found.points, case.points[nodes]) < 1e-11
