"""Cells whose nodes lost their coordinates are left out."""

import numpy as np
from assembled import box, stiffness

from unassemble.elasticity.materials import recognise_cells
from unassemble.nodes import given_numbering, nodal_matrix


def test_cells_with_nodes_that_have_no_coordinates_are_left_out():
    whole = stiffness("quad-q1", box("quad-q1", (5, 5)), lam=1.5, mu=1.0)
    rows = np.arange(whole.matrix.shape[0])
    numbering = given_numbering(whole.matrix, rows // 2, rows % 2)
    cells = recognise_cells(nodal_matrix(whole.matrix, numbering), whole.points)
    some = np.ones(len(whole.points), dtype=bool)
    some[cells.blocks["quad"][0, 0]] = False
    left = cells.among(some)
    assert 0 < len(left.blocks["quad"]) < len(cells.blocks["quad"])
    assert some[left.blocks["quad"]].all()
    assert len(left.lame) == len(left.blocks["quad"])
    assert not cells.among(~np.ones_like(some)).blocks
