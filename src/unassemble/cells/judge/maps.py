"""The conformal map of a piece, and c, where cells may be wrong."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ...errors import GeometryError, SolverError
from ...planar.conformal import ConformalOptions, conformal_map
from ...planar.piece import PieceMesh
from ...topology import Piece

_OPTIONS = ConformalOptions(max_factorisations=4)  # what takes more has wrong cells
_SMALL = 40
"""Vertices up to which dense linear algebra, without set-up, is faster: wrong labellings have many small pieces."""


def map_of(piece: Piece, weights: NDArray) -> PieceMesh | None:
    """The conformal map; None where the entries allow none.

    `weights` (e,): -A_ij of its edges.
    """
    if piece.n_vertices <= _SMALL:
        return small_map(piece, weights)
    try:
        found = conformal_map(piece, weights, sharp=False, options=_OPTIONS)
    except (GeometryError, SolverError):
        return None
    return PieceMesh(found.z, found.scale) if np.isfinite(found.z).all() and found.scale else None


def small_map(piece: Piece, weights: NDArray) -> PieceMesh | None:
    """The same by dense linear algebra: with the last vertex at zero, the greatest mu with T z = mu (c L / 2) z."""
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
        value, vector = scipy.linalg.eigh(area[:-1, :-1], energy[:-1, :-1], subset_by_index=[n - 2, n - 2])
    except np.linalg.LinAlgError:  # the energy of a mesh is positive
        return None
    with np.errstate(all="ignore"):
        scale = float(size / value[0])
    possible = value[0] > 0 and np.isfinite(scale) and np.isfinite(vector).all()
    return PieceMesh(np.append(vector[:, 0], 0), scale) if possible else None
