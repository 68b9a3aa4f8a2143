"""Nodes that can move while the identities hold, or all but hold: they are set aside, and the rest is certain."""

import numpy as np
import pytest

from unassemble.nodes import SOFT, shape

N, LOOSE = 200, 6


def fields_of_a_body(value):
    """Translations, positions, and a field of a few nodes alone that satisfies the identities up to a value."""
    rng = np.random.default_rng(0)
    points = rng.standard_normal((N, 3))
    fields = np.zeros((N, 3, 6))
    fields[:, range(3), range(3)] = 1
    fields[:, :, 3] = points
    fields[:LOOSE, :, 4] = rng.standard_normal((LOOSE, 3))
    fields[:, :, 5] = rng.standard_normal((N, 3))
    orthonormal = np.linalg.qr(fields.reshape(3 * N, 6))[0].reshape(N, 3, 6)
    return points, orthonormal, np.array([1e-17, 2e-17, 3e-17, 4e-17, value, 1e-3])


@pytest.mark.parametrize(("value", "loose"), [(1e-16, LOOSE), (SOFT / 3, LOOSE), (10 * SOFT, 0)])
def test_what_moves_almost_freely_is_loose(value, loose):
    points, fields, values = fields_of_a_body(value)
    found = shape(fields, values, np.ones(N, dtype=bool), N)
    moving = np.isnan(found.points).any(axis=1)
    assert np.count_nonzero(moving) == loose
    assert moving[:loose].all()
    assert found.exact
    assert not found.freedom
    kept = points[~moving] - points[~moving].mean(axis=0)
    own = found.points[~moving]
    scale = (own * kept).sum() / (own * own).sum()
    assert np.abs(scale * own - kept).max() < 1e-9
