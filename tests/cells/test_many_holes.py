"""A third of all triangles removed anywhere, nothing else being known: not where holes are, nor c."""

import numpy as np
import pytest

from families import FAMILIES
from meshes import largest_error, random_mesh, specimen, triangle_set
from unassemble import recover
from vanishing import used


@pytest.mark.parametrize("seed", range(4))
def test_holes_that_may_share_edges(seed):
    """Fifteen to fifty holes of three edges among others, no triangle by itself to tell c."""
    rng = np.random.default_rng(seed)
    known = specimen(*FAMILIES["gnawed"](rng), c=[1.0, -2.5, 1e-3][seed % 3], seed=seed)
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
    assert largest_error(found.points, known.points) < 1e-8


def test_triangles_removed_at_random():
    """Seventy pieces that only single vertices hold together."""
    points, triangles = random_mesh(600, 4, holes=False)
    cells = triangles[np.random.default_rng(4).random(len(triangles)) > 1 / 3]
    known = specimen(*used(points, cells), c=-2.5, seed=4)
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert triangle_set(found.triangles) == triangle_set(known.triangles)
