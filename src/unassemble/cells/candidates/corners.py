"""Corners: two consecutive edges of an empty face that may be two sides of a right-angled triangle.

The side of a triangle that faces a right angle has the weight cot(pi / 2) / 2 = 0, and on the boundary no other
triangle adds to it: such an entry is often not stored, and the triangle shows as two edges only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...topology.faces import FaceComplex, joined


def corners_of(embedding: FaceComplex, outside: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Corners a-b-c, (k, 3), of which a-c is no edge, and pairs (corner, half-edge) of what each takes up as a cell.

    They lie along the half-edges `outside`, (2 e,) bool, those of empty faces.

    Where nothing else meets at b, a face beyond both edges would contain the vanished side as a diagonal: the
    corner takes up the far sides as well, if they belong to such a face.
    """
    n, one = embedding.n_vertices, np.flatnonzero(outside)
    other = embedding.successor[one]
    a, b, c = embedding.tail[one], embedding.head[one], embedding.head[other]
    apart = (a != c) & ~joined(n, embedding.edges, a, c)
    halves, vertices = np.column_stack([one, other])[apart], np.column_stack([a, b, c])[apart]
    near = np.column_stack([np.repeat(np.arange(len(halves)), 2), halves.ravel()])
    lone = np.bincount(embedding.tail, minlength=n)[vertices[:, 1]] == 2
    lone &= ~outside[halves[:, 0] ^ 1]
    far = np.column_stack([np.repeat(np.flatnonzero(lone), 2), halves[lone].ravel() ^ 1])
    return vertices, np.concatenate([near, far])
