"""Error bars of points that whole entries determine, from what these leave of each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..planar.cotangent import edge_weights
from ..planar.deviations import covariances
from ..planar.normal import WeightJacobian, distant_pair
from ..topology import Piece
from .inside import InsideMesh


def deviations_inside(
    piece: Piece, mesh: InsideMesh, weights: NDArray, z: NDArray, *, known_scale: bool, stretch: NDArray | None
) -> NDArray[np.float64]:
    """Standard deviations of the coordinates of a piece; NaN where they are not determined.

    Parameters
    ----------
    piece : Piece
    mesh : InsideMesh
    weights : (e,) float64
        -A_ij.
    z : (n,) complex128
        Its positions, in the Laplacian's frame turned and scaled as wanted.
    known_scale : bool
    stretch : (2, 2) float64 or None
        From that frame to the one in which deviations are wanted.

    Returns
    -------
    (n, 2) float64
    """
    known, used = mesh.determined, mesh.entries
    result = np.full((len(z), 2), np.nan)
    spare = int(used.sum()) - 2 * int(known.sum()) + (4 if known_scale else 3)
    if spare > 0:
        own = edge_weights(piece, mesh.z)
        sigma = float(np.linalg.norm((weights / mesh.scale - own)[used])) / np.sqrt(spare)
        jacobian = WeightJacobian(piece, z, np.where(used, 1.0, np.inf))
        pins = np.append(np.flatnonzero(~known), np.flatnonzero(known)[distant_pair(z[known])])
        covariance = covariances(
            jacobian, np.where(used, own, 0.0), z[known], pins,
            free_scale=not known_scale, stretch=stretch, nodes=lambda moves: moves[known],
        )  # fmt: skip
        result[known] = sigma * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return result
