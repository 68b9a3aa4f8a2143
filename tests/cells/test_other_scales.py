"""Pieces all of which fit with another factor c, too."""

import numpy as np
import pytest
import scipy.sparse as sp

from unassemble import recover


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
