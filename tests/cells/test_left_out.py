"""A cell that is missing, or one too many, is told by the entries of its sides alone."""

import numpy as np
import pytest

from meshes import random_mesh, specimen
from unassemble.cells.labels.left_out import left_out
from unassemble.cells.reading import Reading
from unassemble.cells.search import read_cells
from unassemble.matrix import check_matrix
from vanishing import forgotten, half_jittered, triangular_holes

MESHES = {
    "triangles": random_mesh(150, seed=2),
    "squares and triangles": half_jittered(9),
    "triangular holes": triangular_holes(150, 4, 3),
}


def fitting(known) -> Reading:
    """The right cells."""
    checked = check_matrix(known.matrix)
    reading = read_cells(checked.n, checked.edges, -checked.entries)
    assert reading.fits
    return reading


@pytest.mark.parametrize("name", MESHES)
def test_one_wrong_label_is_named_first(name):
    right = fitting(forgotten(specimen(*MESHES[name], c=2.0, seed=1)))
    inside = right.candidates.size <= 4
    rng = np.random.default_rng(0)
    first = 0
    wrong = rng.choice(np.flatnonzero(inside & (right.labels | ~right.candidates.corner)), 12, replace=False)
    for cell in wrong:
        labels = right.labels.copy()
        labels[cell] ^= True
        spoilt = Reading.of(right.candidates, labels)
        named = [tuple(some) for some in left_out(spoilt)]
        first += (cell,) in named[:3]
    assert first >= 9
