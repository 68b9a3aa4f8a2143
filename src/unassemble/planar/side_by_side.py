"""Pieces side by side as one that falls apart: each has a similarity of its own, and c is one for all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece
from ..topology.together import united
from .normal import distant_pair


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Several drawn pieces as one.

    Attributes
    ----------
    piece : Piece
        Their disjoint union.
    z : (n,) complex128
        Each part about the origin, with the radius 1.
    pins : (2 parts,) int64
        Two vertices of each part, far apart: held, they fix all similarities.
    vertices, edges : (parts + 1,) int64
        Where the vertices and the edges of each part begin.
    """

    piece: Piece
    z: NDArray[np.complex128]
    pins: NDArray[np.int64]
    vertices: NDArray[np.int64]
    edges: NDArray[np.int64]

    @classmethod
    def of(cls, pieces: Sequence[Piece], positions: Sequence[NDArray]) -> SideBySide:
        """Put pieces next to each other that are drawn at any places and in any size."""
        vertices = np.append(0, np.cumsum([piece.n_vertices for piece in pieces]))
        edges = np.append(0, np.cumsum([len(piece.edges) for piece in pieces]))
        centred = [z - z.mean() for z in positions]
        parts = [z / np.abs(z).max() for z in centred]
        pins = np.concatenate([first + distant_pair(z) for first, z in zip(vertices, parts, strict=False)])
        return cls(united(pieces), np.concatenate(parts), pins, vertices, edges)

    def split(self, values: NDArray, starts: NDArray[np.int64]) -> list[NDArray]:
        """Values of all vertices, or of all edges, part by part."""
        return np.split(values, starts[1:-1])
