"""Drawings that differ in one face.

Where a part of the graph hangs on the two ends of an edge, the edge lies on three 3-cycles or more, one of them on the
part itself. At most two are faces, and which, the graph does not say: the part lies inside of one of the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from .embedding import crowded, drawing_with_faces, short_faces
from .faces import FaceComplex, around


def redrawn(drawing: FaceComplex, first: NDArray) -> Iterator[tuple[NDArray[np.int64], FaceComplex]]:
    """Drawings in which one more 3-cycle is a face, and as many as possible of the short cycles that were are.

    Parameters
    ----------
    drawing : FaceComplex
    first : (n,) float64
        Cycles at vertices of high value are taken first.

    Yields
    ------
    cycle : (3,) int64
        The new face.
    drawing : FaceComplex
    """
    n, edges = drawing.n_vertices, drawing.edges
    cycles = short_faces(n, edges)
    present = [_are_faces(drawing, c) for c in cycles]
    triangles, quads = cycles[0], cycles[1][present[1]]
    sides = around(n, edges, triangles) >> 1
    full = crowded(n, edges, triangles)
    missing = np.flatnonzero(~present[0])
    for k in missing[np.argsort(-first[triangles[missing]].sum(axis=1), kind="stable")].tolist():
        # On each crowded side one of two faces gives way.
        rivals = [np.flatnonzero(present[0] & (sides == side).any(axis=1)) for side in sides[k, full[k]]]
        for gone in product(*rivals):
            kept = present[0].copy()
            kept[list(gone)], kept[k] = False, True
            sure = kept & ~full.any(axis=1)
            sure[k] = True
            for faces in ([triangles[kept], quads], [triangles[kept]], [triangles[sure]]):
                other = drawing_with_faces(n, edges, faces)
                if other is not None:
                    yield triangles[k], other
                    break


def _are_faces(drawing: FaceComplex, cycles: NDArray) -> NDArray[np.bool_]:
    """(m,) whether cycles (m, k), in one sense or the other, are faces."""
    blocks = drawing.split()
    along = around(drawing.n_vertices, drawing.edges, cycles)
    label = blocks.face[np.stack([along, along ^ 1])]
    whole = (label == label[:, :, :1]).all(axis=2) & (blocks.size[label[:, :, 0]] == cycles.shape[1])
    return np.asarray(whole.any(axis=0))
