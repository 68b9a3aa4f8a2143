"""Cells with vanished sides that hang on the rest by an edge or two, and what is left of cells beside holes."""

import numpy as np
import pytest

from families import FAMILIES, member
from meshes import largest_error, specimen
from unassemble import recover
from unassemble.cells.candidates.candidates import Candidates
from unassemble.cells.candidates.crossed_faces import CrossedFaces
from unassemble.matrix import check_matrix
from unassemble.topology.embedding import face_complexes
from unassemble.topology.turning_over import turned_over, turns
from vanishing import forgotten


@pytest.mark.parametrize(("family", "seed"), [("glued", 29), ("perforated", 18)])
def test_all_that_may_be_a_cell(family, seed):
    known, _ = member(family, seed)
    found = recover(known.matrix)
    assert found.certified, found.reason
    assert largest_error(found.points, known.points) <= 1e-10


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (2, 0, 1, 3), (3, 2, 0, 1)])
def test_half_circles_in_a_row(order):
    """Each hangs on the one before by a side, the first on a triangle; all but their diameters are bare or shared."""
    triangle = [0j, 1 + 0j, 0.3 + 0.9j]
    points, triangles = [*triangle], [(0, 1, 2)]
    a, b = 2, 1  # the free side of a-b is on the left
    for k in np.argsort(order):
        angle = 0.5 + 0.15 * k
        along = points[b] - points[a]
        centre = (points[a] + points[b]) / 2 + 0.5j * along / np.tan(angle)
        new = centre + (points[b] - centre) * np.exp(1j * np.array([0.55, 1.0]) * np.pi)
        first = len(points)
        points += new.tolist()
        triangles += [(a, b, first), (a, first, first + 1)]
        a, b = first, b
    z = np.array(points)
    known = forgotten(specimen(np.column_stack([z.real, z.imag]), np.array(triangles), c=-2.5, seed=order[0]))
    found = recover(known.matrix, scale=-2.5)
    assert found.certified, found.reason
    assert found.n_polygons == len(order)
    assert largest_error(found.points, known.points) <= 1e-11


@pytest.mark.parametrize("seed", [49, 9])
def test_faces_with_a_part_turned_over_take_half_edges_of_those_they_replace(seed):
    known = forgotten(specimen(*FAMILIES["integer"](np.random.default_rng(seed)), seed=seed))
    checked = check_matrix(known.matrix)
    for drawing in (one.split() for one in face_complexes(checked.n, checked.edges)):
        crossed = CrossedFaces.of(drawing)
        parts = np.split(crossed.vertices, np.cumsum(crossed.size)[:-1]) if len(crossed) else []
        reached = {tuple(sorted(part.tolist())) for part in parts}
        wanted = set()
        for turn in turns(drawing):
            other = turned_over(drawing, turn)
            faces = np.split(other.tail[other.order], other.offsets[1:-1])
            before = {tuple(sorted(f.tolist())) for f in np.split(drawing.tail[drawing.order], drawing.offsets[1:-1])}
            wanted |= {
                name
                for face in faces
                if len(face) <= 8
                and (name := tuple(sorted(face.tolist()))) not in before
                and len(set(name)) == len(name)
            }
        assert wanted <= reached
        for k, part in enumerate(parts):
            half = crossed.sides[crossed.sides[:, 0] == k, 1]
            assert sorted(drawing.edges[half >> 1].ravel().tolist()) == sorted(2 * part.tolist())
        names = {name for name, _ in Candidates.of(drawing, -checked.entries, wide=True).names}
        assert reached <= names
