"""Cells on half circles: their longest side, a diameter, faces right angles only and has vanished from the boundary.

A corner triangle is one with three vertices. Those with four show as paths of three edges along an empty face;
longer ones are not looked for.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...topology.faces import FaceComplex, joined

_FULL = 0.85 * np.pi  # angle sum below which a path may be one: it should be pi/2, but shares weights with neighbours
_INNER = 0.35 * np.pi  # excess of angles at its two inner vertices, which look like vertices inside the mesh


def half_circles(whole: FaceComplex, outside: NDArray[np.bool_], angles: NDArray, excess: NDArray) -> NDArray[np.int64]:
    """(k, 3) half-edges of paths that may be cells on half circles.

    Parameters
    ----------
    whole : FaceComplex
        A drawing of the graph.
    outside : (2 e,) bool
        Half-edges of empty faces.
    angles : (2 e,) float64
        Facing each half-edge, weights being shared equally.
    excess : (n,) float64
        Of the angles about each vertex over 2 pi.
    """
    one = np.flatnonzero(outside)
    two = whole.successor[one]
    three = whole.successor[two]
    a, b, c, d = whole.tail[one], whole.head[one], whole.head[two], whole.head[three]
    paths = np.column_stack([one, two, three])
    chosen = outside[paths].all(axis=1) & (a != c) & (b != d) & (a != d) & (angles[paths].sum(axis=1) < _FULL)
    chosen &= (np.abs(excess[b]) < _INNER) & (np.abs(excess[c]) < _INNER)
    for p, q in ((a, c), (b, d), (a, d)):
        chosen &= ~joined(whole.n_vertices, whole.edges, p, q)
    return paths[chosen]
