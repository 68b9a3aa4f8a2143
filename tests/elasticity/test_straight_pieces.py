"""Straight pieces in place of the bent ones that they are part of."""

import numpy as np
import pytest

from unassemble.elasticity.nullspace import Solution
from unassemble.elasticity.straight import Straight, in_place
from unassemble.recovery import Evidence


@pytest.mark.parametrize("loose", [0, 3])
def test_a_node_that_was_loose_belongs_to_no_bent_piece(loose):
    """Cells place nodes that linear equations leave loose, also the first of the piece."""
    component = np.repeat([0, 1], 4)
    component[loose] = -1
    points = np.random.default_rng(0).standard_normal((8, 2))
    evidence = (Evidence(6, 0.0, 1e-3, 4), Evidence(3, 0.0, 1e-3, 4))
    bent = np.where(component[:, None] < 0, np.nan, points)
    valid = np.ones((8, 2, 2), dtype=bool)
    found = Solution(valid, component, bent, evidence, ("affine", ""), exact=True, warnings=())
    straight = np.where(np.arange(8)[:, None] < 4, -points, np.nan)
    better = in_place(found, valid, [Straight(straight, 1.5, Evidence(6, 0.0, 1e-2, 3))])
    assert better.freedoms == ("", "")
    assert [one.gap for one in better.evidence] == [1e-3, 1e-2]
    assert np.array_equal(better.component, np.repeat([1, 0], 4))
    assert np.array_equal(better.points, np.concatenate([-points[:4], points[4:]]))
