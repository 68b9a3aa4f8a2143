"""The certificate of a structure's coordinates: its rigid rotations cost nothing, and its members' blocks are theirs.

Forces share no code with the solver. Blocks of members are held against the formula that found them, at the points as
they are written.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodes.nodal import determined
from .layouts import Layout
from .straight import Straight, misfits


def forces(
    matrix: sp.csr_array,
    layout: Layout,
    node_of_row: NDArray[np.int64],
    direction_of_row: NDArray[np.int64],
    points: NDArray[np.float64],
    counted: NDArray[np.bool_],
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Forces that rigid rotations of the nodes bring about, relative to what makes them up.

    That is bounded, without signs, by nodes that move by their distance from the centroid and turn by one: about
    single axes both may be nothing but rounding.

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
        Rows and rotations away from supports.

    Returns
    -------
    force : (k,) float64
        Of all rows and rotations that count.
    used : (N,) bool
        Rows with one that counts.
    """
    moves = len(layout.displacements)
    known, moving = determined(points), direction_of_row >= 0
    motions = layout.rigid_motions(np.where(known[:, None], points, 0.0))[:, :, moves:]
    force = np.abs(matrix @ (motions[node_of_row, direction_of_row] * moving[:, None]))
    lever = np.where(direction_of_row < moves, np.linalg.norm(points, axis=1)[node_of_row], 1.0)
    size = abs(matrix) @ np.where(moving & known[node_of_row], lever, 0.0)
    touched = abs(matrix) @ (~known[node_of_row]).astype(float) > 0
    used = counted & (~touched & (size > 0))[:, None]
    return (force / np.where(size > 0, size, 1)[:, None])[used], used.any(axis=1)


def members_misfits(
    members: Straight, layout: Layout, points: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """How far the blocks of straight members are from those of members between the points.

    Returns
    -------
    ends : (k, 2) int64
        Of members both of whose nodes have coordinates.
    misfit : (k,) float64
        Relative to the size of each part of the block.
    """
    some = determined(points)[members.ends].all(axis=1)
    ends = members.ends[some]
    if not len(ends):
        return ends, np.empty(0)
    return ends, misfits(members.blocks[some], points[ends[:, 0]] - points[ends[:, 1]], layout)
