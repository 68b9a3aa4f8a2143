"""The face that bounds each block of a drawing from outside, which is never a cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...topology.faces import FaceComplex

_MOST_VERTICES = 1500  # of a graph whose Laplacian is inverted: less than a second


def outer_faces(blocks: FaceComplex, sums: NDArray, weights: NDArray) -> NDArray[np.bool_]:
    """One face of each block: its longest, among equals that of the largest angle sum.

    Where all faces have three edges any of them may be the outer one, and resistances tell, see :func:`_openings`.

    Parameters
    ----------
    blocks : FaceComplex
    sums : (faces,) float64
        Of angles.
    weights : (e,) float64
        -A_ij of the edges, in any units.
    """
    block = blocks.block[blocks.order[blocks.offsets[:-1]]]
    value = sums
    closed = (np.bincount(block, blocks.size != 3) == 0) & (np.bincount(block) > 2)
    if closed.any() and blocks.n_vertices <= _MOST_VERTICES:
        value = np.where(closed[block], _openings(blocks, weights), sums)
    order = np.lexsort((value, blocks.size, block))
    last = order[np.append(np.flatnonzero(np.diff(block[order])), len(order) - 1)]
    longest = np.zeros(len(sums), dtype=bool)
    longest[last] = True
    return longest


def _openings(blocks: FaceComplex, weights: NDArray) -> NDArray[np.float64]:
    """(faces,) determinant of the resistances between the corners of triangles; 0 for other faces.

    Between the corners of the outer triangle a mesh without holes conducts as this triangle by itself would: a map
    that is linear along its sides is harmonic if it is linear inside. Then the determinant is 4 / c^2. Holes make it
    larger, and between the corners of another triangle what lies around it conducts as well: there it is smaller.
    """
    n = blocks.n_vertices
    laplacian = np.zeros((n, n))
    i, j = blocks.edges.T
    laplacian[i, j] = laplacian[j, i] = -weights
    np.fill_diagonal(laplacian, -laplacian.sum(axis=1))
    triangles = np.flatnonzero(blocks.size == 3)
    a, b, c = blocks.tail[blocks.order[blocks.offsets[triangles][:, None] + np.arange(3)]].T
    value = np.zeros(len(blocks.size))
    try:
        resistance = np.linalg.inv(laplacian + np.abs(weights).max() / n)
    except np.linalg.LinAlgError:  # of no mesh
        return value

    def product(p: NDArray, q: NDArray) -> NDArray[np.float64]:
        return np.asarray(resistance[p, q] - resistance[p, c] - resistance[c, q] + resistance[c, c])

    value[triangles] = product(a, a) * product(b, b) - product(a, b) ** 2
    return value
