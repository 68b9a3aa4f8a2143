"""Parts between two vertices turned over: two faces are made crosswise, all others stay."""

from itertools import pairwise

import numpy as np
import pytest

from families import FAMILIES
from meshes import edge_list, specimen
from unassemble.matrix import check_matrix
from unassemble.topology.embedding import face_complexes
from unassemble.topology.faces import FaceComplex, from_cycles
from unassemble.topology.turning_over import turned_over, turns
from vanishing import forgotten


def _faces(drawing: FaceComplex) -> list[tuple[int, ...]]:
    parts = np.split(drawing.tail[drawing.order], drawing.offsets[1:-1])
    return sorted(tuple(sorted(face.tolist())) for face in parts)


def test_a_part_beside_paths_of_two_edges_and_of_three():
    """The part's sides have two edges and three as well: its neighbours are faces of four and six edges, or of five."""
    paths = [[0, 1, 2], [0, 3, 4, 2]]
    part = [[0, 5, 2], [0, 6, 7, 2], [5, 6]]
    edges = np.array(sorted(tuple(sorted(pair)) for path in [*paths, *part] for pair in pairwise(path)))
    drawing = next(iter(face_complexes(8, edges))).split()
    (sizes,) = {tuple(sorted(turned_over(drawing, turn).size.tolist())) for turn in turns(drawing)}
    assert {sizes, tuple(sorted(drawing.size.tolist()))} == {(3, 4, 4, 5, 6), (3, 4, 5, 5, 5)}


def test_blocks_that_meet_in_two_vertices_have_no_part_between_them():
    """Two quadrilaterals, four triangles each, with two opposite corners in common."""
    half = np.array([[0, 2, 3], [0, 3, 4], [1, 2, 3], [1, 3, 4]])
    triangles = np.concatenate([half, np.where(half > 1, half + 3, half)])
    drawing = from_cycles(8, edge_list(triangles), [triangles])
    assert drawing is not None
    for turn in turns(drawing):
        other = turned_over(drawing, turn)
        assert np.array_equal(np.sort(other.successor), np.arange(len(other.successor)))
        assert other.is_sphere()


@pytest.mark.parametrize("seed", [49, 9, 12])
def test_faces_in_the_place_of_others(seed):
    known = forgotten(specimen(*FAMILIES["integer"](np.random.default_rng(seed)), seed=seed))
    checked = check_matrix(known.matrix)
    count = 0
    for drawing in (one.split() for one in face_complexes(checked.n, checked.edges)):
        for turn in turns(drawing):
            count += 1
            other = turned_over(drawing, turn)
            assert other.is_sphere()
            faces = _faces(drawing)
            for old in turn.old:
                faces.remove(tuple(sorted(old)))
            assert _faces(other) == sorted(faces + [tuple(sorted(new)) for new in turn.new])
            assert set(turn.new) != set(turn.old)
            for new, halves in zip(turn.new, turn.halves, strict=True):
                ends = {frozenset(pair) for pair in pairwise((*new, new[0]))}
                assert {frozenset(drawing.edges[half >> 1].tolist()) for half in halves} == ends
    assert count or seed != 49
