"""Mass matrices: assembled again from the areas of triangles, and compared with the given one."""

import numpy as np
from numpy.typing import NDArray

from .comparison import Certificate, Terms, compared

_PAIRS = np.triu_indices(3)  # of the corners of a triangle, each with itself among them


def certify_masses(
    edges: NDArray, entries: NDArray, diagonal: NDArray, triangles: NDArray, areas: NDArray
) -> Certificate:
    """Compare all entries with those of the consistent mass matrix of linear triangles.

    A triangle of area a has a/6 on the diagonal and a/12 elsewhere.

    Parameters
    ----------
    edges : (e, 2) int64
        Pairs i < j of the matrix.
    entries : (e,) float64
        A_ij.
    diagonal : (n,) float64
        A_ii.
    triangles : (m, 3) int64
        Rows of the corners.
    areas : (m,) float64
        Density times area; negative ones, with the sign of the entries, for a negative density.
    """
    one, other = triangles[:, _PAIRS[0]], triangles[:, _PAIRS[1]]
    places = np.minimum(one, other).ravel(), np.maximum(one, other).ravel()
    values = np.asarray(areas)[:, None] * np.where(one == other, 1 / 6, 1 / 12)
    flat = np.flatnonzero(~(np.asarray(areas) * np.sign(diagonal[0]) > 0))
    return compared(len(diagonal), edges, entries, places, values.ravel(), flat, Terms(diagonal))
