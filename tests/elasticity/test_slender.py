"""Slender bodies, which bend so easily that rounding of the entries shows in the identities."""

import numpy as np
import pytest
from assembled import box, eliminated, error, on_plane, stiffness

from unassemble.elasticity import recover_elasticity
from unassemble.elasticity.nullspace.slender import unbent
from unassemble.nodes.nodal import nodal_matrix, valid_pairs
from unassemble.nodes.unknowns import given_numbering


def beam(kind, length):
    """So many nodes by 3, of about equal distances."""
    return stiffness(kind, box(kind, (length, 3), stretch=(0.53 * length, 1)), lam=1.5)


@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1"])
def test_free_beams(kind):
    case = beam(kind, 3001)
    found = recover_elasticity(case.matrix)
    assert found.certified
    assert found.evidence[0].gap < 1e-6
    assert found.evidence[0].settled
    assert error(found.points, case.points) < 1e-11


def test_a_beam_clamped_at_one_end():
    case = beam("quad-q1", 1601)
    matrix, nodes = eliminated(case, np.repeat(on_plane(case, 0)[:, None], 2, axis=1))
    found = recover_elasticity(matrix)
    assert found.certified
    assert error(found.points, case.points[nodes]) < 1e-11


@pytest.mark.parametrize("cells", [False, True])
def test_beams_in_space(cells):
    case = stiffness("hex-q1", box("hex-q1", (601, 2, 2), stretch=(531, 1, 1)), lam=1.5)
    found = recover_elasticity(case.matrix, cells=cells)
    assert found.certified
    assert error(found.points, case.points) < 1e-11


@pytest.mark.parametrize("kind", ["tri-p1", "quad-q1"])
def test_strips_that_bend_less_easily_are_certified_without_elements(kind):
    case = beam(kind, 601)
    found = recover_elasticity(case.matrix, cells=False)
    assert found.certified
    assert error(found.points, case.points) < 1e-12


def test_thin_bodies_lose_no_digits_where_charts_meet():
    case = stiffness("tet-p1", box("tet-p1", (201, 4, 4), stretch=(60, 1, 1)), lam=1.5)
    matrix, nodes = eliminated(case, np.repeat(on_plane(case, 0)[:, None], 3, axis=1))
    found = recover_elasticity(matrix, cells=False)
    assert found.certified
    assert error(found.points, case.points[nodes]) < 1e-12


@pytest.mark.parametrize("loose", ["every other node", "the nodes in the middle"])
def test_rows_that_do_not_hold_a_beam_together_leave_it_as_it_is(loose):
    """Rows that touch a loose node do not count; the rest may be none, or fit two halves anywhere."""
    case = beam("quad-q1", 201)
    nodal = nodal_matrix(case.matrix, given_numbering(case.matrix, *np.divmod(np.arange(case.matrix.shape[0]), 2)))
    points, x = case.points.copy(), case.points[:, 0]
    middle = np.abs(x - x.mean()) < 0.4
    points[middle if loose == "the nodes in the middle" else np.arange(len(x)) % 2 == 0] = np.nan
    points[~middle] += 1e-6 * np.random.default_rng(0).standard_normal(2) * (x[~middle] > x.mean())[:, None]
    better, residual = unbent(nodal, valid_pairs(nodal), points, 1e-4)
    assert residual == np.inf
    assert np.array_equal(better, points, equal_nan=True)
