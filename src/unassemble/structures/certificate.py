"""The certificate of a structure's coordinates: its rigid rotations cost nothing, and its members' blocks are theirs.

Nothing is shared with the solver: members between the points, as they are written, are set up by the textbook.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..nodes.nodal import determined
from .layouts import Layout
from .nodes import Nodes
from .recognise import StructuralNumbering
from .straight import Straight


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
    ends, given = members.ends[some], members.blocks[some]
    if not len(ends):
        return ends, np.empty(0)
    moves = len(layout.displacements)
    place = np.array([*layout.displacements, *(3 + k for k in layout.rotations)])
    again = _member_blocks(given, points[ends[:, 1]] - points[ends[:, 0]], place)
    parts = (slice(moves), slice(moves, None))
    size = [np.abs(given[:, a, b]).max(axis=(1, 2)) for a in parts for b in parts]
    off = [np.abs(again[:, a, b] - given[:, a, b]).max(axis=(1, 2)) for a in parts for b in parts]
    with np.errstate(divide="ignore", invalid="ignore"):
        misfit = np.divide(off, size).max(axis=0)
    return ends, np.where(np.isnan(misfit), np.inf, misfit)


def _member_blocks(given: NDArray[np.float64], vectors: NDArray[np.float64], place: NDArray[np.int64]) -> NDArray:
    """(m, b, b) blocks of members along vectors (m, d), which stretch, bend and twist like the given ones.

    Deflections that meet the stiffness S = 12 E I / l^3 give -S between deflections, S l / 2 and -S l / 2 between
    deflections and slopes, and S l^2 / 6 between slopes, which are the rotations times the axis (Przemieniecki, Theory
    of Matrix Structural Analysis, 1968, section 5.6). `place` holds the unknowns among three of either kind.
    """
    block = np.zeros((len(given), 6, 6))
    block[:, place[:, None], place] = given
    length = np.linalg.norm(vectors, axis=1)[:, None, None]
    axis = np.zeros((len(given), 3, 1))
    axis[:, : vectors.shape[1], 0] = vectors
    axis = axis / np.where(length > 0, length, 1)
    along = axis @ axis.transpose(0, 2, 1)
    across = np.eye(3) - along
    bending = -across @ (block + block.transpose(0, 2, 1))[:, :3, :3] @ across / 2
    slopes = np.cross(np.eye(3), axis.transpose(0, 2, 1)).transpose(0, 2, 1)
    bent = bending @ slopes * length / 2
    again = np.zeros_like(block)
    again[:, :3, :3] = along @ block[:, :3, :3] @ along - bending
    again[:, :3, 3:], again[:, 3:, :3] = bent, -bent.transpose(0, 2, 1)
    again[:, 3:, 3:] = along @ block[:, 3:, 3:] @ along + slopes.transpose(0, 2, 1) @ bent * length / 3
    return again[:, place[:, None], place]
