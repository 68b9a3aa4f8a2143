"""Parts between two vertices turned over: two faces are made crosswise, all others stay."""

from itertools import pairwise

import numpy as np
import pytest

from families import FAMILIES
from meshes import specimen
from unassemble.matrix import check_matrix
from unassemble.topology.embedding import face_complexes
from unassemble.topology.faces import FaceComplex
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
