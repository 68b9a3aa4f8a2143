"""Nothing meaningless is written: no mesh whose points coincide, lie in a line or nowhere."""

from __future__ import annotations

import numpy as np
import pytest

from meshes import random_mesh, specimen
from unassemble import recover
from unassemble.matrix import check_matrix
from unassemble.planar import collapsed
from unassemble.topology import surfaces

SPOILT = {
    "points coincide": lambda z: np.where(np.arange(len(z)) < 7, z[0], z),
    "all points lie in a line": lambda z: z.real * (1 + 2j),
    "positions are not finite": lambda z: np.where(np.arange(len(z)) == 3, np.nan, z),
}


@pytest.mark.parametrize("why", SPOILT)
def test_positions_that_are_no_mesh(why):
    known = specimen(*random_mesh(80, seed=1))
    checked = check_matrix(known.matrix)
    piece = surfaces(checked.n, checked.edges).pieces[0]
    z = known.points[piece.vertices] @ [1, 1j]
    assert not collapsed(piece, z)
    assert collapsed(piece, SPOILT[why](z)) == why


def test_very_fine_and_very_flat_meshes_are_meshes():
    for stretch in (1e-3, 1.0):
        points, triangles = random_mesh(80, seed=1)
        points = points * [1.0, stretch]
        found = recover(specimen(points, triangles).matrix)
        assert found.n_points == len(points)
        assert np.isfinite(found.points).all()
