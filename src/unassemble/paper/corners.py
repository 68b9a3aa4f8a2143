"""Where every angle stands: its triangle, its vertex, the edge it faces (paper, sections 2.1 and 2.3).

An angle is a *corner*, numbered 3 * triangle + position, so that the angles of an element follow one
another (paper, section 3.1). The corners about a vertex form *fans*: an interior vertex has one
closed fan, a boundary vertex one open fan for every time that the boundary passes through it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..topology import Piece


@dataclass(frozen=True)
class Counts:
    """The numbers of section 2.3.

    Attributes
    ----------
    v, e, m, w, h : int
        Vertices, edges, triangles, interior vertices, holes.
    """

    v: int
    e: int
    m: int
    w: int
    h: int

    @property
    def unknowns(self) -> int:
        """3 m angles."""
        return 3 * self.m

    @property
    def equations(self) -> int:
        """e equations (1)-(2), m equations (3), w equations (4)."""
        return self.e + self.m + self.w

    @property
    def surplus(self) -> int:
        """Equations less unknowns: 1 - h by Euler's formula, where the boundary nowhere touches itself.

        Theorem 1 of the paper says that it is never negative; that fails for two holes or more.
        """
        return self.equations - self.unknowns


@dataclass(frozen=True, eq=False)
class Corners:
    """Incidences of the 3 m angles of a piece.

    Attributes
    ----------
    edge : (3m,) int64
        Edge faced by each corner.
    facing : (e, 2) int64
        Corners that face each edge; -1 in the second place on the boundary.
    fan : (3m,) int64
        Fan of each corner. Fans 0 to w - 1 are closed: one for each interior vertex, in order of the vertices.
    fan_vertex : (number of fans,) int64
        Vertex of each fan.
    fan_loop : (number of fans,) int64
        Boundary loop of an open fan, -1 for a closed one.
    loop_lengths : (loops,) int64
        Edges (and fans) of each boundary loop.
    counts : Counts
    """

    edge: NDArray[np.int64]
    facing: NDArray[np.int64]
    fan: NDArray[np.int64]
    fan_vertex: NDArray[np.int64]
    fan_loop: NDArray[np.int64]
    loop_lengths: NDArray[np.int64]
    counts: Counts

    @property
    def w(self) -> int:
        """Number of interior vertices, the closed fans."""
        return self.counts.w

    @property
    def interior(self) -> NDArray[np.int64]:
        """(w,) interior vertices, in order."""
        return self.fan_vertex[: self.counts.w]


def corners_of(piece: Piece) -> Corners:
    """Number the angles of a piece and find what each belongs to."""
    facing, vertex = piece.facing, piece.triangles.ravel()
    raw = _fans(facing, vertex.size)
    n_fans = int(raw.max()) + 1
    raw_vertex = np.empty(n_fans, dtype=np.int64)
    raw_vertex[raw] = vertex
    raw_loop = np.full(n_fans, -1, dtype=np.int64)
    raw_loop[raw[_tail_corners(piece)]] = np.repeat(np.arange(piece.n_loops), np.diff(piece.loop_offsets))
    order = np.lexsort((raw_vertex, raw_loop >= 0))
    rank = np.empty(n_fans, dtype=np.int64)
    rank[order] = np.arange(n_fans)
    w = int((raw_loop < 0).sum())
    counts = Counts(piece.n_vertices, len(piece.edges), len(piece.triangles), w, piece.n_loops - 1)
    return Corners(
        edge=piece.opposite.ravel(),
        facing=facing,
        fan=rank[raw],
        fan_vertex=raw_vertex[order],
        fan_loop=raw_loop[order],
        loop_lengths=np.diff(piece.loop_offsets),
        counts=counts,
    )


def following_corner(step: int, corner: NDArray) -> NDArray:
    """The corner `step` places on in the same triangle."""
    return 3 * (corner // 3) + (corner + step) % 3


def _fans(facing: NDArray, n_corners: int) -> NDArray:
    """Components of the corners under 'same vertex, triangles with a common edge there'."""
    one, two = facing[facing[:, 1] >= 0].T
    # The common edge runs from corner one + 1 to one + 2, in the neighbour from two + 2 to two + 1.
    a = np.concatenate([following_corner(1, one), following_corner(2, one)])
    b = np.concatenate([following_corner(2, two), following_corner(1, two)])
    graph = sp.coo_array((np.ones(len(a), np.int8), (a, b)), shape=(n_corners, n_corners))
    _, label = csgraph.connected_components(graph, directed=False)
    return label.astype(np.int64)


def _tail_corners(piece: Piece) -> NDArray:
    """(b,) the corner at the tail of each boundary edge, in the order of `piece.boundary`."""
    facing = piece.facing
    outer = facing[facing[:, 1] < 0, 0]
    vertex, n = piece.triangles.ravel(), piece.n_vertices
    tail, head = following_corner(1, outer), following_corner(2, outer)
    key = vertex[tail] * n + vertex[head]
    order = np.argsort(key)
    wanted = piece.boundary[:, 0] * n + piece.boundary[:, 1]
    return tail[order[np.searchsorted(key[order], wanted)]]
