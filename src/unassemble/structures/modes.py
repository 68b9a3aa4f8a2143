"""The near-null space of structures whose nodes have rotations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..elasticity.nodal import determined
from .layouts import Layout


def turning_modes(
    layout: Layout, points: NDArray[np.float64], node_of_row: NDArray[np.int64], direction_of_row: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Near-null space of a structure whose nodes have rotations: translations, then rotations about the centroid.

    Parameters
    ----------
    layout : Layout
    points : (n, d) float64
        NaN rows get what they have without moving: translations, and rotations of the node itself.
    node_of_row, direction_of_row : (N,) int64
        A direction of -1 is not known, and gets zeros.

    Returns
    -------
    (N, 6) or (N, 3) float64
        Rotations are divided by the radius of gyration, so that none swamps another.
    """
    known = determined(points)
    x = points - points[known].mean(axis=0)
    radius = float(np.sqrt((x[known] ** 2).sum(axis=1).mean())) or 1.0
    motions = layout.rigid_motions(np.where(known[:, None], x, 0.0))
    motions[:, :, len(layout.displacements) :] /= radius
    return np.asarray(motions[node_of_row, direction_of_row] * (direction_of_row >= 0)[:, None])
