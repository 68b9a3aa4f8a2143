"""The certificate of a structure's coordinates: its rigid rotations cost nothing. Shares no code with the solver."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..elasticity.nodal import determined
from .layouts import Layout


def largest_force(
    matrix: sp.csr_array,
    layout: Layout,
    node_of_row: NDArray[np.int64],
    direction_of_row: NDArray[np.int64],
    points: NDArray[np.float64],
    counted: NDArray[np.bool_],
) -> float:
    """Largest force that a rigid rotation of the nodes brings about, relative to the sum of those that make it up.

    Parameters
    ----------
    matrix : (N, N) sparse
        As it was given.
    layout : Layout
    node_of_row, direction_of_row : (N,) int64
        Rows whose direction is -1 do not move.
    points : (n, d) float64
        NaN where not determined; rows that touch such nodes do not count.
    counted : (N, rotations) bool
        Rows and rotations away from supports; without any the answer is infinite.
    """
    moves = len(layout.displacements)
    known = determined(points)
    motions = layout.rigid_motions(np.where(known[:, None], points, 0.0))[:, :, moves:]
    field = motions[node_of_row, direction_of_row] * (direction_of_row >= 0)[:, None]
    force, size = matrix @ field, abs(matrix) @ np.abs(field)
    touched = abs(matrix) @ (~known[node_of_row]).astype(float) > 0
    used = counted & ~touched[:, None] & (size > 0)
    return float((np.abs(force[used]) / size[used]).max(initial=0.0)) if used.any() else float("inf")
