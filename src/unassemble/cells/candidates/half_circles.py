"""Cells on half circles: their longest side, a diameter, faces right angles only and has vanished from the boundary.

A corner triangle is one with three vertices. Those with four show as paths of three edges along an empty face, and so
on; on irregular points more than six on one circle are rare.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...topology.faces import FaceComplex, joined

_EDGES = (3, 4, 5)  # of a path
_FULL = 0.85 * np.pi  # angle sum below which a path may be one: it should be pi/2, but shares weights with neighbours
_INNER = 0.35 * np.pi  # excess of angles at its inner vertices, which look like vertices inside the mesh


def half_circles(
    whole: FaceComplex, outside: NDArray[np.bool_], angles: NDArray, excess: NDArray, *, wide: bool = False
) -> list[NDArray[np.int64]]:
    """(k, m) half-edges of paths of m edges that may be cells on half circles, for each m.

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
    wide : bool
        Whether the excess may be twice as much, and inner vertices may be on another boundary or be passed twice.
    """
    inner = (-np.inf, 2 * _INNER) if wide else (-_INNER, _INNER)
    return [_paths(whole, outside, angles, excess, inner, m) for m in _EDGES]


def _paths(
    whole: FaceComplex, outside: NDArray[np.bool_], angles: NDArray, excess: NDArray, inner: tuple[float, float], m: int
) -> NDArray[np.int64]:
    """Those of m edges: nowhere else joined to themselves."""
    half = [np.flatnonzero(outside)]
    for _ in range(m - 1):
        half.append(whole.successor[half[-1]])
    paths = np.column_stack(half)
    chosen = outside[paths].all(axis=1) & (angles[paths].sum(axis=1) < _FULL)
    about = excess[whole.head[paths[:, :-1]]]
    chosen &= ((about > inner[0]) & (about < inner[1])).all(axis=1)
    paths = paths[chosen]
    vertices = np.column_stack([whole.tail[paths], whole.head[paths[:, -1]]])
    apart = np.ones(len(paths), dtype=bool)
    for i, j in combinations(range(m + 1), 2):
        apart &= vertices[:, i] != vertices[:, j]
        if j > i + 1:
            apart &= ~joined(whole.n_vertices, whole.edges, vertices[:, i], vertices[:, j])
    return paths[apart]
