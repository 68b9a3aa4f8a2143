"""Pieces that share vertices as one: rings of them hold each other, as far as their similarities do not give way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from ..tolerances import SINGULAR
from ..topology import Piece
from ..topology.together import united
from .normal import distant_pair

_MOST_PIECES = 300
"""Above this their equations at hinges, which are dense here, take too long."""


@dataclass(frozen=True, eq=False)
class Hinged:
    """Several drawn pieces that meet where they share vertices.

    Attributes
    ----------
    piece : Piece
        All of them, each vertex once, all triangles the same way round.
    z : (n,) complex128
        About the origin, with the radius 1.
    pins : (k,) int64
        Vertices that, held, fix all similarities that leave the pieces joined.
    local : list of (n_p,) int64
        The vertices of each piece among these.
    closings : int
        Real equations by which rings of pieces hold these.
    """

    piece: Piece
    z: NDArray[np.complex128]
    pins: NDArray[np.int64]
    local: list[NDArray[np.int64]]
    closings: int

    @classmethod
    def of(cls, pieces: Sequence[Piece], positions: Sequence[NDArray]) -> Hinged | None:
        """Pieces in one frame, mirrored or not; None where there are too many, or no ring holds any of them."""
        if len(pieces) > _MOST_PIECES:
            return None
        union = united(pieces)
        vertices, local = np.unique(union.vertices, return_inverse=True)
        count = np.bincount(local)
        if not (count > 1).any():
            return None
        at = np.concatenate(positions)
        z = (np.bincount(local, at.real) + 1j * np.bincount(local, at.imag)) / count
        z = (z - z.mean()) / np.abs(z - z.mean()).max()
        owner = np.repeat(np.arange(len(pieces)), [piece.n_vertices for piece in pieces])
        null, closings = _freedoms(owner, local, z, len(pieces))
        if not closings:
            return None
        split = np.split(local, np.cumsum([piece.n_vertices for piece in pieces])[:-1])
        whole = _turned(union, vertices, local, z)
        return cls(whole, z, _pins(split, z, null), split, closings)


def _freedoms(owner: NDArray, local: NDArray, z: NDArray, n: int) -> tuple[NDArray[np.complex128], int]:
    """(2 n, k) turns and shifts of the pieces that leave them joined, and how many equations at hinges are too many."""
    order = np.argsort(local, kind="stable")
    one = np.flatnonzero(local[order[1:]] == local[order[:-1]])
    p, q, at = owner[order[one]], owner[order[one + 1]], z[local[order[one]]]
    equations = np.zeros((len(one), 2 * n), dtype=np.complex128)
    row = np.arange(len(one))
    equations[row, p], equations[row, q] = at, -at
    equations[row, n + p], equations[row, n + q] = 1, -1
    _, size, directions = np.linalg.svd(np.linalg.qr(equations, mode="r"))  # of many equations, no large left factor
    rank = int((size > SINGULAR * size[0]).sum())
    return directions[rank:].conj().T, 2 * (len(one) - rank)


def _pins(local: list[NDArray[np.int64]], z: NDArray, null: NDArray) -> NDArray[np.int64]:
    """As many vertices as there are freedoms (2 n, k), on which these act independently.

    Two vertices of a piece tell how it is moved: others need not be asked.
    """
    ends = np.concatenate([own[distant_pair(z[own])] for own in local])
    owner = np.repeat(np.arange(len(local)), 2)
    moves = null[owner] * z[ends, None] + null[len(local) + owner]
    return np.asarray(ends[la.qr(moves.T, mode="r", pivoting=True)[1][: null.shape[1]]])


def _turned(union: Piece, vertices: NDArray, local: NDArray, z: NDArray) -> Piece:
    """The union with shared vertices made one, triangles that lie the other way round turned over."""
    a, b, c = z[local[union.triangles]].T
    mirrored = (np.conj(b - a) * (c - a)).imag < 0
    turned = np.array([0, 2, 1])
    triangle, position = np.divmod(union.facing, 3)
    position = np.where(mirrored[triangle], turned[position], position)
    swapped = mirrored[:, None]
    triangles = local[np.where(swapped, union.triangles[:, turned], union.triangles)]
    return Piece(
        vertices=vertices,
        edge_rows=union.edge_rows,
        edges=local[union.edges],
        triangles=triangles,
        opposite=np.where(swapped, union.opposite[:, turned], union.opposite),
        facing=np.where(union.facing >= 0, 3 * triangle + position, -1),
        boundary=local[union.boundary],
        loop_offsets=union.loop_offsets,
    )
