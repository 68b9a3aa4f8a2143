"""Cut cells, stairs and slits: a few wrong labels among many right ones, most of them corners at the boundary."""

import numpy as np
import pytest
from numpy.typing import NDArray

from families import FAMILIES
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
# three labels that have to change together; corners that are cells too many and bring a lesser c; a corner beside a
# hole in what looks like a quadrilateral; a half circle one of whose vertices is on another boundary as well.
@pytest.mark.parametrize(
    ("family", "seed"),
    [
        ("cut_cells", 4),
        ("bisected", 5),
        ("stairs", 6),
        ("stairs", 9),
        ("cut_cells", 17),
        ("stairs", 319),
        ("cut_cells", 412),
        ("cut_cells", 413),
        ("cut_cells", 435),
        ("cut_cells", 448),
        ("integer", 444),
        ("integer", 452),
        ("integer", 303),
        ("integer", 458),
    ],
)
def test_domain(family, seed):
    rng = np.random.default_rng(seed)
    c = float(rng.choice([1.0, -2.5, 1e-3]))  # as benchmarks/cells.py draws them
    known = forgotten(specimen(*FAMILIES[family](rng), c=c, seed=seed))
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert largest_error(found.points, known.points) <= 1e-10


def graph(known) -> tuple[int, NDArray[np.int64], NDArray[np.float64]]:
    """Rows, edges and weights."""
    checked = check_matrix(known.matrix)
    return checked.n, checked.edges, -checked.entries


def test_positions_are_not_those_of_the_mirror_image():
    """Pieces that have been solved in one orientation are known in that one only."""
    known = specimen(*random_mesh(60, holes=False))
    solved: dict[bytes, PieceMesh | None] = {}
    for triangles in (known.triangles, known.triangles[:, ::-1]):
        cells = Polygons(3 * np.arange(len(triangles) + 1), triangles.ravel())
        cell_set = CellSet(*graph(known), None, cells, np.zeros(len(triangles), dtype=bool))
        assert Reading.of(cell_set, np.ones(len(triangles), dtype=bool), solved).fits


def test_triangles_of_a_small_lattice_with_holes_and_no_known_factor():
    """Six triangles of 44 are holes: with some of them filled many readings nearly fit, at a lesser c."""
    known = forgotten(specimen(*FAMILIES["lattice"](np.random.default_rng(12)), c=-2.5, seed=12))
    assert read_cells(*graph(known)).fits
