"""Many pieces as one disjoint union, for array code over all of them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .surface import Piece


class Together:
    """Pieces with their vertices, edges, triangles and boundary edges numbered one piece after the other.

    `pieces`: at least one.
    """

    def __init__(self, pieces: Sequence[Piece]):
        self._pieces = pieces

    @cached_property
    def n_vertices(self) -> NDArray[np.int64]:
        """(pieces,)."""
        return np.array([len(piece.vertices) for piece in self._pieces])

    @cached_property
    def n_edges(self) -> NDArray[np.int64]:
        """(pieces,)."""
        return np.array([len(piece.edges) for piece in self._pieces])

    @cached_property
    def n_triangles(self) -> NDArray[np.int64]:
        """(pieces,)."""
        return np.array([len(piece.triangles) for piece in self._pieces])

    @cached_property
    def n_boundary(self) -> NDArray[np.int64]:
        """(pieces,)."""
        return np.array([len(piece.boundary) for piece in self._pieces])

    @cached_property
    def vertices(self) -> NDArray[np.int64]:
        """(v,) rows of the matrix."""
        return np.concatenate([piece.vertices for piece in self._pieces])

    @cached_property
    def edge_rows(self) -> NDArray[np.int64]:
        """(e,) rows of the whole graph's edge list."""
        return np.concatenate([piece.edge_rows for piece in self._pieces])

    @cached_property
    def inner(self) -> NDArray[np.bool_]:
        """(e,) edges with a triangle on both sides."""
        return np.concatenate([piece.facing for piece in self._pieces])[:, 1] >= 0

    @cached_property
    def triangle_piece(self) -> NDArray[np.int64]:
        """(m,)."""
        return np.repeat(np.arange(len(self._pieces)), self.n_triangles)

    @cached_property
    def triangles(self) -> NDArray[np.int64]:
        """(m, 3) places in `vertices`."""
        shift = _starts(self.n_vertices)[self.triangle_piece, None]
        return np.concatenate([piece.triangles for piece in self._pieces]) + shift

    @cached_property
    def opposite(self) -> NDArray[np.int64]:
        """(m, 3) places in `edge_rows`."""
        shift = _starts(self.n_edges)[self.triangle_piece, None]
        return np.concatenate([piece.opposite for piece in self._pieces]) + shift

    @cached_property
    def boundary(self) -> NDArray[np.int64]:
        """(b, 2) places in `vertices`."""
        shift = np.repeat(_starts(self.n_vertices), self.n_boundary)[:, None]
        return np.concatenate([piece.boundary for piece in self._pieces]) + shift

    @cached_property
    def loop_lengths(self) -> NDArray[np.int64]:
        """(loops,)."""
        return np.concatenate([np.diff(piece.loop_offsets) for piece in self._pieces])

    @cached_property
    def n_loops(self) -> NDArray[np.int64]:
        """(pieces,)."""
        return np.array([piece.n_loops for piece in self._pieces])


def reversed_within(counts: NDArray, chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Rows of consecutive groups of so many rows each, those of chosen groups in reverse order."""
    group = np.repeat(np.arange(len(counts)), counts)
    rows = np.arange(len(group))
    start = _starts(counts)
    return np.where(chosen[group], 2 * start[group] + counts[group] - 1 - rows, rows)


def _starts(counts: NDArray) -> NDArray[np.int64]:
    return np.asarray(np.cumsum(counts) - counts, dtype=np.int64)
