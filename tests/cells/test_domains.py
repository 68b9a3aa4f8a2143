"""Cut cells, stairs and slits: a few wrong labels among many right ones, most of them corners at the boundary."""

import pytest
from scipy.sparse.csgraph import connected_components

from families import member
from meshes import largest_error
from unassemble import recover


# Corners of a twentieth of a square; corners that have to change places; two corners
# about one vertex, which look like a wrong entry; corners that are cells too many and bring a lesser c.
@pytest.mark.parametrize(
    ("family", "seed"),
    [
        ("cut_cells", 4),
        ("stairs", 6),
        ("stairs", 9),
        ("cut_cells", 17),
        ("cut_cells", 413),
        ("cut_cells", 435),
        ("cut_cells", 448),
        ("integer", 444),
    ],
)
def test_domain(family, seed):
    known, _ = member(family, seed)
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert largest_error(found.points, known.points) <= 1e-10


def test_two_cells_too_many():
    """The quotients of their maps are a fifth and three fifths of that of the mesh; it has another component, too."""
    known, _ = member("cut_cells", 55)
    found = recover(known.matrix)
    assert found.certified, found.reason
    count, label = connected_components(known.matrix)
    assert count == 2
    for k in range(count):
        rows = label == k
        assert largest_error(found.points[rows], known.points[rows]) <= 1e-10
