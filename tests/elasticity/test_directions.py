"""Directions of rows: right, or said to be unknown."""

import numpy as np
import pytest
from assembled import box, permuted_nodes, stiffness
from supported import given

from unassemble.elasticity import recover_elasticity


@pytest.mark.parametrize(("support", "seed"), [("symmetry", 0), ("several", 1)])
def test_rows_of_nodes_without_coordinates(support, seed):
    """In structured meshes sums over wrong directions vanish, too."""
    case = permuted_nodes(stiffness("hex-s2", box("hex-s2", (4, 4, 4)), lam=1.5), seed)
    truth = given(case, support, "interleaved", "stored", seed)
    found = recover_elasticity(truth.matrix)
    told = found.direction_of_row >= 0
    live = abs(truth.matrix).sum(axis=1) > np.abs(truth.matrix.diagonal())
    placed = np.isfinite(found.points).all(axis=1)[found.node_of_row]
    assert found.certified
    assert told[placed].all()
    assert (found.direction_of_row == truth.direction)[told & live].all()
    assert any("not proven" in warning for warning in found.warnings)
    modes = found.rigid_body_modes()
    expected = (truth.direction[:, None] == np.arange(3)) & told[:, None]
    assert np.array_equal(modes[live, :3], expected[live])
    assert not modes[~told].any()
