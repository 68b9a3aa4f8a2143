"""Small pieces, of which wrong readings have many: dense linear algebra, and no set-up."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ...planar.piece import PieceMesh
from ...topology import Piece

SMALL = 40
"""Most vertices of a small piece."""


def small_maps(piece: Piece, weights: NDArray, most: int) -> list[PieceMesh]:
    """The conformal map of a small piece, and maps of the next greater quotients; none where the entries allow none.

    With the last vertex at zero, the greatest mu with T z = mu (c L / 2) z and their vectors.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij of its edges.
    most : int
    """
    size = float(np.abs(weights).max()) * np.sign(weights.sum())
    if not size:
        return []
    n = piece.n_vertices
    energy = np.zeros((n, n))
    area = np.zeros((n, n), dtype=np.complex128)
    i, j = piece.edges.T
    energy[i, j] = energy[j, i] = -weights / (2 * size)
    np.fill_diagonal(energy, -energy.sum(axis=1))
    np.add.at(area, (piece.boundary[:, 0], piece.boundary[:, 1]), -0.25j)
    np.add.at(area, (piece.boundary[:, 1], piece.boundary[:, 0]), 0.25j)
    try:
        values, vectors = scipy.linalg.eigh(
            area[:-1, :-1], energy[:-1, :-1], subset_by_index=[max(n - 1 - most, 0), n - 2]
        )
    except np.linalg.LinAlgError:  # the energy of a mesh is positive
        return []
    maps = []
    for value, vector in zip(values[::-1], vectors.T[::-1], strict=True):
        with np.errstate(all="ignore"):
            scale = float(size / value)
        if value > 0 and np.isfinite(scale) and np.isfinite(vector).all():
            maps.append(PieceMesh(np.append(vector, 0), scale))
    return maps
