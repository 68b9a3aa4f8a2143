"""Valid angle sequences, and what is left of an embedding's angles (paper, section 5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece
from .bfs import bfs_embedding
from .corners import Corners
from .starts import angles_of


@dataclass(frozen=True)
class Violations:
    """How far an angle sequence is from satisfying each condition of a valid one, in radians.

    Attributes
    ----------
    triangles : float
        Condition 1: angles of a triangle add up to pi.
    interior : float
        Condition 2: angles about an interior vertex add up to 2 pi.
    embedding : float
        Condition 3: the triangles of BFS-Embedding have the given angles.
    """

    triangles: float
    interior: float
    embedding: float


def violations(piece: Piece, corners: Corners, angles: NDArray) -> Violations:
    """The three conditions on angles (3m,), the largest violation of each."""
    phi = np.asarray(angles).reshape(-1, 3)
    about = np.bincount(corners.fan, phi.ravel(), len(corners.fan_vertex))[: corners.w]
    z = bfs_embedding(piece, angles)
    return Violations(
        float(np.abs(phi.sum(axis=1) - np.pi).max()),
        float(np.abs(about - 2 * np.pi).max(initial=0.0)),
        float(np.abs(signed_angles(z, piece.triangles) - phi).max()),
    )


def signed_angles(z: NDArray, triangles: NDArray) -> NDArray[np.float64]:
    """(m, 3) angles as :func:`angles_of`, with the sign of the triangle's area."""
    p = z[triangles]
    area = ((p[:, 1] - p[:, 0]).conj() * (p[:, 2] - p[:, 0])).imag
    return angles_of(z, triangles) * np.where(area < 0, -1.0, 1.0)[:, None]


def inverted(z: NDArray, triangles: NDArray) -> int:
    """Number of triangles of z that are turned over or flat: zero for a planar embedding, locally."""
    p = z[triangles]
    return int((((p[:, 1] - p[:, 0]).conj() * (p[:, 2] - p[:, 0])).imag <= 0).sum())
