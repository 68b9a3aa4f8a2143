"""Straight members, each of which the block of its two nodes tells by itself, next to supports as well.

A member that bends without shear has a block of few numbers. With U, V, W and T its parts of displacements and
rotations at node i and at node j, and D the displacements that rotations about node j bring to node i,

    V = U D / 2,    W = - V^T,    T = - D^T U D / 6 + g e e^T,    U e = h e,

where e points along the member, g is its torsion and h its stretching (the cubic Hermite element in either plane; e.g.
Przemieniecki, Theory of Matrix Structural Analysis, 1968, section 5.6). The first equation determines x_i - x_j, and
the others contradict it where the block is not a member's: it has nine entries in the plane for four numbers, and 36 in
space for eight. No sum over neighbours is involved, so that supports and springs to the ground do not matter.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..tolerances import LAST_DIGITS
from .layouts import Layout
from .nodes import Nodes


@dataclass(frozen=True, eq=False)
class Straight:
    """Members that their blocks tell."""

    ends: NDArray[np.int64]  # (m, 2) nodes, the lesser first
    vectors: NDArray[np.float64]  # (m, dim) position of the first less that of the second
    blocks: NDArray[np.float64]  # (m, b, b)


def straight_members(nodes: Nodes, allowed: float, ends: NDArray[np.int64] | None = None) -> Straight:
    """Members between nodes that have all unknowns that any has; up to an allowed misfit, or those of given ends."""
    b = nodes.layout.block_size
    present = nodes.present
    whole: NDArray[np.bool_] = np.asarray((present | ~present.any(axis=0)).all(axis=1))
    if not nodes.layout.rotations:
        return Straight(np.empty((0, 2), np.int64), np.empty((0, nodes.layout.dim)), np.empty((0, b, b)))
    bsr = nodes.matrix.tobsr((b, b))
    i, j = np.repeat(np.arange(nodes.n), np.diff(bsr.indptr)), bsr.indices.astype(np.int64)
    upper = (i < j) & whole[i] & whole[j]
    pairs, blocks = np.column_stack([i[upper], j[upper]]), bsr.data[upper]
    vectors = told_by_blocks(blocks, nodes.layout)
    if ends is None:
        good = np.flatnonzero(misfits(blocks, -vectors, nodes.layout) <= allowed)
    else:
        good = np.flatnonzero(np.isin(pairs @ [nodes.n, 1], ends @ [nodes.n, 1]))
    return Straight(pairs[good], vectors[good], blocks[good])


def told_by_blocks(blocks: NDArray[np.float64], layout: Layout) -> NDArray[np.float64]:
    """(m, dim) position of the first node less that of the second, as V = U D / 2 has it; zero where none is told."""
    moves = len(layout.displacements)
    size = np.abs(blocks).max(axis=(1, 2), initial=0, keepdims=True)
    blocks = blocks / np.where(size > 0, size, 1)
    one = layout.rigid_motions(np.eye(layout.dim))[:, :moves, moves:]
    sides = np.einsum("mac,kct->matk", blocks[:, :moves, :moves], one)
    sides = sides.reshape(len(blocks), moves * (layout.block_size - moves), layout.dim)
    right = 2 * blocks[:, :moves, moves:].reshape(sides.shape[:2])
    return np.asarray(np.einsum("mkr,mr->mk", np.linalg.pinv(sides, rcond=LAST_DIGITS), right))


def misfits(blocks: NDArray[np.float64], vectors: NDArray[np.float64], layout: Layout) -> NDArray[np.float64]:
    """(m,) how far blocks are from those of members along vectors (m, dim), relative to the size of each part.

    The members stretch, bend and twist like the given ones: deflections that meet the stiffness S = 12 E I / l^3 give
    -S between deflections, S l / 2 and -S l / 2 between deflections and slopes, and S l^2 / 6 between slopes, which are
    the rotations times the axis. Infinite where a part vanishes, displacements are not coupled to rotations, say.
    """
    moves = len(layout.displacements)
    place = np.array([*layout.displacements, *(3 + k for k in layout.rotations)])
    block = np.zeros((len(blocks), 6, 6))
    block[:, place[:, None], place] = blocks
    length = np.linalg.norm(vectors, axis=1)[:, None, None]
    axis = np.zeros((len(blocks), 3, 1))
    axis[:, : layout.dim, 0] = vectors
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
    again = again[:, place[:, None], place]
    parts = (slice(moves), slice(moves, None))
    size = [np.abs(blocks[:, a, b]).max(axis=(1, 2), initial=0) for a in parts for b in parts]
    off = [np.abs(again[:, a, b] - blocks[:, a, b]).max(axis=(1, 2), initial=0) for a in parts for b in parts]
    with np.errstate(divide="ignore", invalid="ignore"):
        misfit = np.divide(off, size).max(axis=0)
    return np.where(np.isnan(misfit), np.inf, misfit)


def blocks_at(matrix: sp.csr_array, i: NDArray[np.int64], j: NDArray[np.int64], b: int) -> NDArray[np.float64]:
    """(k, b, b) blocks of a matrix that begin with rows i and columns j."""
    rows, columns = np.broadcast_arrays(i[:, None, None] + np.arange(b)[:, None], j[:, None, None] + np.arange(b))
    return entries_at(matrix, rows.ravel(), columns.ravel()).reshape(-1, b, b)


def entries_at(matrix: sp.csr_array, i: NDArray[np.int64], j: NDArray[np.int64]) -> NDArray[np.float64]:
    """(k,) entries of a matrix at rows i and columns j, zero where none is stored."""
    return np.asarray(sp.coo_array(matrix[i, j]).toarray()).ravel() if len(i) else np.empty(0)
