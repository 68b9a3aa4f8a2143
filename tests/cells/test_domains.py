"""Cut cells, stairs and slits: a few wrong labels among many right ones, most of them corners at the boundary."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from families import FAMILIES, member
from meshes import largest_error, random_mesh, specimen
from unassemble import recover
from unassemble.cells.candidates.cell_set import CellSet
from unassemble.cells.reading import Reading
from unassemble.cells.search import read_cells
from unassemble.matrix import check_matrix
from unassemble.planar.piece import PieceMesh
from unassemble.topology import Polygons
from vanishing import forgotten


# Corners of a twentieth of a square; a cell across the mouth of a slit; corners that have to change places; one corner
# that leaves the misfit of a wrong entry; several that leave little without six entries, or what looks like noise;
# three labels that have to change together; two corners about one vertex, which look like a wrong entry; corners that
# are cells too many and bring a lesser c; a corner beside a hole in what looks like a quadrilateral; a half circle one
# of whose vertices is on another boundary as well; a part between two vertices that all drawings have turned over.
@pytest.mark.parametrize(
    ("family", "seed"),
    [
        ("cut_cells", 4),
        ("bisected", 5),
        ("stairs", 6),
        ("stairs", 9),
        ("cut_cells", 17),
        ("stairs", 319),
        ("stairs", 21),
        ("cut_cells", 412),
        ("cut_cells", 413),
        ("cut_cells", 435),
        ("cut_cells", 448),
        ("integer", 444),
        ("integer", 303),
        ("integer", 458),
        ("integer", 49),
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


def graph(known) -> tuple[int, NDArray[np.int64], NDArray[np.float64]]:
    """Rows, edges and weights."""
    checked = check_matrix(known.matrix)
    return checked.n, checked.edges, -checked.entries


def test_positions_are_not_those_of_the_mirror_image():
    """Pieces that have been solved in one orientation are known in that one only."""
    known = specimen(*random_mesh(60, holes=False))
    solved: dict[bytes, PieceMesh | None] = {}
    for triangles in (known.triangles, known.triangles[:, ::-1]):
        cells = Polygons.of_triangles(triangles)
        cell_set = CellSet(*graph(known), None, cells, np.zeros(len(triangles), dtype=bool))
        assert Reading.of(cell_set, np.ones(len(triangles), dtype=bool), solved).fits


def test_triangles_of_a_small_lattice_with_holes_and_no_known_factor():
    """Six triangles of 44 are holes: with some of them filled many readings nearly fit, at a lesser c."""
    known = forgotten(specimen(*FAMILIES["lattice"](np.random.default_rng(12)), c=-2.5, seed=12))
    assert read_cells(*graph(known)).fits
