"""A third of all triangles removed anywhere, nothing else being known: not where holes are, nor c."""

import numpy as np
import pytest

from families import FAMILIES
from meshes import largest_error, specimen, triangle_set
from unassemble import recover


@pytest.mark.parametrize("seed", range(4))
def test_holes_that_may_share_edges(seed):
    """Fifteen to fifty holes of three edges among others, no triangle by itself to tell c."""
    rng = np.random.default_rng(seed)
    known = specimen(*FAMILIES["gnawed"](rng), c=[1.0, -2.5, 1e-3][seed % 3], seed=seed)
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
    assert largest_error(found.points, known.points) < 1e-8
