"""Small pieces, of which wrong readings have many: dense linear algebra, and no set-up."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ..planar.piece import PieceMesh
from ..topology import Piece

SMALL = 40
"""Most vertices of a small piece."""


def small_map(piece: Piece, weights: NDArray) -> PieceMesh | None:
    """The conformal map of a small piece; None where the entries allow none.

    With the last vertex at zero, the greatest mu with T z = mu (c L / 2) z and its vector.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij of its edges.
    """
    size = float(np.abs(weights).max()) * np.sign(weights.sum())
    if not size:
        return None
    n = piece.n_vertices
    energy = np.zeros((n, n))
    area = np.zeros((n, n), dtype=np.complex128)
    i, j = piece.edges.T
    energy[i, j] = energy[j, i] = -weights / (2 * size)
    np.fill_diagonal(energy, -energy.sum(axis=1))
    np.add.at(area, (piece.boundary[:, 0], piece.boundary[:, 1]), -0.25j)
    np.add.at(area, (piece.boundary[:, 1], piece.boundary[:, 0]), 0.25j)
    try:
        values, vectors = scipy.linalg.eigh(area[:-1, :-1], energy[:-1, :-1], subset_by_index=[n - 2, n - 2])
    except np.linalg.LinAlgError:  # the energy of a mesh is positive
        return None
    with np.errstate(all="ignore"):
        scale = float(size / values[0])
    z = np.append(vectors[:, 0], 0)
    return PieceMesh(z, scale) if values[0] > 0 and np.isfinite(scale) and np.isfinite(z).all() else None
