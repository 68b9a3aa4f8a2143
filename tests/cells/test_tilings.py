"""Tilings by octagons and squares: long cells and short ones, most sides on the boundary, and other meshes alike."""

import numpy as np
import pytest

from meshes import largest_error, specimen
from unassemble import recover
from unassemble.cells import beginning, completion
from vanishing import forgotten, octagons


@pytest.mark.parametrize("scale", [None, -2.5])
@pytest.mark.parametrize("squares", [True, False])
@pytest.mark.parametrize("shape", [(2, 3), (4, 4), (8, 8)])
def test_octagons(shape, squares, scale):
    known = forgotten(specimen(*octagons(np.ones(shape, dtype=bool), squares=squares), c=-2.5))
    found = recover(known.matrix, scale=scale)
    assert found.certified, found.reason
    assert largest_error(found.points, known.points) <= 1e-12


def test_right_triangles_cut_from_octagons_are_not_certified(monkeypatch):
    """All of one shape, they have one factor c wherever they are put; the octagons are named, with another one."""

    def blind(*graph):
        with monkeypatch.context() as context:
            context.setattr(beginning, "tilings", lambda _: iter(()))
            return read_cells(*graph)

    read_cells = completion.read_cells
    monkeypatch.setattr(completion, "read_cells", blind)
    known = forgotten(specimen(*octagons(np.ones((3, 4), dtype=bool), squares=False)))
    found = recover(known.matrix)
    assert found.backward_error < 1e-12
    assert not np.allclose(found.scale, 1)
    assert found.status == "ambiguous"
    assert any(len(cell) == 8 for other in found.alternatives for cell in other.other_cells)
