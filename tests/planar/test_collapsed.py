"""Nothing meaningless is written: no mesh whose points coincide, lie in a line or nowhere."""

from __future__ import annotations

import numpy as np
import pytest

from meshes import random_mesh, specimen
from unassemble import GeometryError, recover
from unassemble.planar import piece as pieces
from unassemble.readings import ScalarReadings
from unassemble.scalar import solving

KNOWN = specimen(*random_mesh(80, seed=1))
SPOILT = {
    "points coincide": lambda z: np.where(np.arange(len(z)) < 7, z[0], z),
    "all points lie in a line": lambda z: z.real * (1 + 2j),
    "positions are not finite": lambda z: np.where(np.arange(len(z)) == 3, np.nan, z),
}


@pytest.mark.parametrize("why", SPOILT)
@pytest.mark.parametrize("refine", [False, True])
def test_positions_that_are_no_mesh(monkeypatch, why, refine):
    def spoilt(*args, **options):
        mesh = found(*args, **options)
        return pieces.PieceMesh(SPOILT[why](mesh.z), mesh.scale)

    where, name = (solving, "refined") if refine else (solving, "_start")
    found = getattr(where, name)
    monkeypatch.setattr(where, name, spoilt)
    if not refine:
        monkeypatch.setattr(solving, "in_doubt", lambda _, topology, *args: np.zeros(len(topology.pieces), dtype=bool))
    monkeypatch.setattr(ScalarReadings, "other_elements", None)  # which would have another way to positions
    with pytest.raises(GeometryError, match=why):
        recover(KNOWN.matrix, refine=refine)


def test_very_fine_and_very_flat_meshes_are_meshes():
    for stretch in (1e-3, 1.0):
        points, triangles = random_mesh(80, seed=1)
        points = points * [1.0, stretch]
        found = recover(specimen(points, triangles).matrix)
        assert found.n_points == len(points)
        assert np.isfinite(found.points).all()
