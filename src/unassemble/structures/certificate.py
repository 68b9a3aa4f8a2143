"""The certificate of a structure's coordinates: its rigid rotations cost nothing, and its members' blocks are theirs.

Positions come from other formulas. Here members between the points, as they are written, are set up by the textbook.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodes.nodal import determined
from .layouts import Layout
from .nodes import Nodes
from .recognise import StructuralNumbering
from .straight import Straight, misfits


def forces(
    matrix: sp.csr_array,
    numbering: StructuralNumbering,
    nodes: Nodes,
    points: NDArray[np.float64],
    valid: NDArray[np.bool_],
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Forces (k,) that rigid rotations of the nodes bring about, with their signs, relative to what makes them up.

    That is bounded, without signs, by nodes that move by their distance from the centroid and turn by one: about
    single axes both may be nothing but rounding. Rows of the given matrix whose direction is -1 do not move; those that
    touch nodes without coordinates do not count, of the others those and the rotations that are `valid`, by node. With
    rows (N,) one of whose forces counts.
    """
    layout, node_of_row, direction_of_row = numbering.layout, numbering.node_of_row, numbering.direction_of_row
    counted = np.zeros((len(node_of_row), len(layout.turning)), dtype=bool)
    counted[nodes.row_of[nodes.present]] = valid[nodes.present]
    moves = len(layout.displacements)
    known, moving = determined(points), direction_of_row >= 0
    motions = layout.rigid_motions(np.where(known[:, None], points, 0.0))[:, :, moves:]
    force = matrix @ (motions[node_of_row, direction_of_row] * moving[:, None])
    lever = np.where(direction_of_row < moves, np.linalg.norm(points, axis=1)[node_of_row], 1.0)
    size = abs(matrix) @ np.where(moving & known[node_of_row], lever, 0.0)
    touched = abs(matrix) @ (~known[node_of_row]).astype(float) > 0
    used = counted & (~touched & (size > 0))[:, None]
    return (force / np.where(size > 0, size, 1)[:, None])[used], used.any(axis=1)


def members_misfits(
    members: Straight, layout: Layout, points: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Ends (k, 2) of straight members, and how far each block is from that of one between the points, part by part."""
    some = determined(points)[members.ends].all(axis=1)
    ends = members.ends[some]
    return ends, misfits(members.blocks[some], points[ends[:, 1]] - points[ends[:, 0]], layout)
