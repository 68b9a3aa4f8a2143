"""An edge on three 3-cycles: drawings in which another two of them are faces."""

import numpy as np

from meshes import edge_list
from unassemble.topology.embedding import drawing_with_faces, face_complexes, short_faces
from unassemble.topology.faces import FaceComplex
from unassemble.topology.redrawing import redrawn

# Triangles on both sides of 0-1, and an ear 0-1-6 that hangs on 0-1.
TRIANGLES = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 4], [1, 2, 4], [0, 3, 5], [1, 3, 5], [0, 4, 5], [0, 1, 6]])


def _faces(drawing: FaceComplex) -> set[tuple[int, ...]]:
    parts = np.split(drawing.tail[drawing.order], drawing.offsets[1:-1])
    return {tuple(sorted(face.tolist())) for face in parts if len(face) == 3}


def test_one_cycle_on_a_crowded_edge_takes_the_place_of_another():
    edges = edge_list(TRIANGLES)
    number = np.random.default_rng(0).permutation(7)
    n = 7
    edges = np.unique(np.sort(number[edges], axis=1), axis=0)
    both = [tuple(sorted(number[t].tolist())) for t in ([0, 1, 2], [0, 1, 3])]
    ear = tuple(sorted(number[[0, 1, 6]].tolist()))
    assert drawing_with_faces(n, edges, short_faces(n, edges)) is None
    drawing = next(iter(face_complexes(n, edges)))
    present = _faces(drawing)
    assert ear in present
    assert len(present & set(both)) == 1
    (cycle, other), *_ = redrawn(drawing, np.zeros(n))
    assert tuple(sorted(cycle.tolist())) == next(iter(set(both) - present))
    assert other.is_sphere()
    assert _faces(other) == present ^ set(both)
