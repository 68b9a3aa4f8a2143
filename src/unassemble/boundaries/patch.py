"""Parts of a piece in which some vertices move and all others stay where they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece


@dataclass(frozen=True, eq=False)
class Patch:
    """The triangles with a part in entries that moving vertices change, as a piece without boundary loops."""

    piece: Piece
    vertices: NDArray[np.int64]  # (k,) of the whole piece
    edges: NDArray[np.int64]  # (e,)
    free: NDArray[np.bool_]  # (k,) vertices that move

    @classmethod
    def about(cls, piece: Piece, free: NDArray[np.bool_]) -> Patch:
        """About vertices (n,) bool that move."""
        touched = np.unique(piece.opposite[free[piece.triangles].any(axis=1)])
        corners = piece.facing[touched]
        chosen = np.unique(corners[corners >= 0] // 3)
        vertices, triangles = np.unique(piece.triangles[chosen], return_inverse=True)
        edges, opposite = np.unique(piece.opposite[chosen], return_inverse=True)
        number = np.full(len(piece.triangles) + 1, -1)
        number[chosen] = np.arange(len(chosen))
        triangle, corner = np.divmod(piece.facing[edges], 3)  # of -1, the last number
        facing = np.where(number[triangle] >= 0, 3 * number[triangle] + corner, -1)
        facing = np.where(facing[:, :1] < 0, facing[:, ::-1], facing)
        ends = np.searchsorted(vertices, piece.edges[edges])
        part = Piece(
            vertices, edges, ends, triangles.reshape(-1, 3), opposite.reshape(-1, 3), facing,
            np.empty((0, 2), np.int64), np.zeros(1, np.int64),
        )  # fmt: skip
        return cls(part, vertices, edges, free[vertices])


def distance(piece: Piece, vertices: NDArray[np.bool_], most: int) -> NDArray[np.int64]:
    """(n,) edges from the nearest of some vertices, (n,) bool; `most` + 1 beyond that."""
    return nearest(piece, np.where(vertices, 0, -1), most)[0]


def nearest(piece: Piece, label: NDArray[np.int64], most: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(n,) edges from the nearest vertex with a label, of labels (n,) from 0 and -1 elsewhere, and this label."""
    far, label = np.where(label >= 0, 0, most + 1), label.copy()
    both = np.concatenate([piece.edges, piece.edges[:, ::-1]])
    for step in range(1, most + 1):
        reached = (far[both[:, 0]] == step - 1) & (far[both[:, 1]] > step)
        if not reached.any():
            break
        here, there = both[reached].T
        far[there], label[there] = step, label[here]
    return far, label


def spread(piece: Piece, values: NDArray, most: np.ufunc, rounds: int) -> NDArray:
    """The least, or most, of values (n,) at vertices up to so many edges away."""
    for _ in range(rounds):
        here, there = values[piece.edges].T
        values = values.copy()
        most.at(values, piece.edges[:, 0], there)
        most.at(values, piece.edges[:, 1], here)
    return values
