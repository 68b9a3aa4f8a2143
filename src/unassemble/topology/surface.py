"""What a graph becomes once its faces are known: connectivity without coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .polygons import Polygons


@dataclass(frozen=True, eq=False)
class Piece:
    """One edge-connected, oriented planar surface of triangles, in a numbering of its own."""

    vertices: NDArray[np.int64]  # (k,) rows of the matrix, in any order
    edge_rows: NDArray[np.int64]  # (e,) rows of the whole graph's edge list
    edges: NDArray[np.int64]  # (e, 2) local vertices i < j
    triangles: NDArray[np.int64]  # (m, 3) local vertices; neighbours run along a common edge in opposite directions
    opposite: NDArray[np.int64]  # (m, 3) the local edge that faces each corner
    # (e, 2) the corners (3 * triangle + position) that face each edge; -1 in the second place on the boundary
    facing: NDArray[np.int64]
    # (b, 2) local directed edges with the surface on the left, loop by loop in running order
    boundary: NDArray[np.int64]
    loop_offsets: NDArray[np.int64]  # (loops + 1,) loop k is ``boundary[loop_offsets[k]:loop_offsets[k + 1]]``

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return len(self.vertices)

    def local(self, rows: NDArray) -> NDArray[np.int64]:
        """Local vertices of some of its matrix rows."""
        order = np.argsort(self.vertices)
        return order[np.searchsorted(self.vertices, rows, sorter=order)]

    @property
    def inner(self) -> NDArray[np.bool_]:
        """(e,) edges with a triangle on both sides."""
        return self.facing[:, 1] >= 0

    @cached_property
    def stencil(self) -> NDArray[np.int64]:
        """(4, e) tail, head and left apex of each edge as its first triangle has them, and its right apex.

        On the boundary the left apex stands in for the right one.
        """
        left = self.facing[:, 0]
        flat = self.triangles.ravel()
        triangle, position = np.divmod(left, 3)
        tail, head = (flat[3 * triangle + (position + turn) % 3] for turn in (1, 2))
        return np.stack([tail, head, flat[left], flat[np.where(self.inner, self.facing[:, 1], left)]])

    @property
    def redundancy(self) -> int:
        """Entries, vanished ones counted, less unknowns: positions up to similarity, and c."""
        return len(self.edges) - (2 * self.n_vertices - 3)

    @property
    def n_loops(self) -> int:
        """Number of boundary loops, the outer one included; loops that touch in a vertex may count as one."""
        return len(self.loop_offsets) - 1

    @property
    def n_holes(self) -> int:
        """Bounded components of the complement in the plane: one less than the loops unless these touch."""
        return 1 - (self.n_vertices - len(self.edges) + len(self.triangles))

    @property
    def longest_loop(self) -> NDArray[np.int64]:
        """Vertices of the loop with the most edges, in running order."""
        k = int(np.argmax(np.diff(self.loop_offsets)))
        return self.boundary[self.loop_offsets[k] : self.loop_offsets[k + 1], 0]


class Together:
    """Pieces, at least one, as one disjoint union: vertices, edges and triangles one piece after the other."""

    def __init__(self, pieces: Sequence[Piece]):
        self.n_vertices = np.array([len(piece.vertices) for piece in pieces])
        n_edges, n_triangles = np.array([(len(piece.edges), len(piece.triangles)) for piece in pieces]).T
        self.triangle_piece = np.repeat(np.arange(len(pieces)), n_triangles)  # (m,)
        shift_vertices, shift_edges = (
            (np.cumsum(count) - count)[self.triangle_piece, None] for count in (self.n_vertices, n_edges)
        )
        self.vertices = np.concatenate([piece.vertices for piece in pieces])  # (v,) rows of the matrix
        self.edge_rows = np.concatenate([piece.edge_rows for piece in pieces])  # (e,) of the whole graph's edge list
        self.triangles = np.concatenate([piece.triangles for piece in pieces]) + shift_vertices  # (m, 3)
        self.opposite = np.concatenate([piece.opposite for piece in pieces]) + shift_edges  # (m, 3)
        self.inner = np.concatenate([piece.inner for piece in pieces])  # (e,) edges with a triangle on both sides


@dataclass(frozen=True, eq=False)
class Topology:
    """All pieces of a graph, and what belongs to none."""

    n_vertices: int
    edges: NDArray[np.int64]  # (e, 2) pairs i < j in lexicographic order
    pieces: tuple[Piece, ...]  # in order of their lowest vertex
    method: str  # how the faces were found: ``"3-cycles"``, ``"cliques"`` or ``"the numbers"``
    failures: tuple[str, ...] = ()  # why connected components of the graph have no mesh, where others have one
    # (k,) rows of `edges` that the matrix does not have: sides of the pieces' triangles on which the entry is zero
    vanished: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    # cells with more than three vertices, whose diagonals are among those
    polygons: Polygons = field(default_factory=Polygons.none)

    @cached_property
    def multiplicity(self) -> NDArray[np.int64]:
        """(n,) number of pieces that each vertex belongs to."""
        count = np.zeros(self.n_vertices, dtype=np.int64)
        for piece in self.pieces:
            count[piece.vertices] += 1
        return count

    @property
    def component(self) -> NDArray[np.int64]:
        """(n,) the first of the pieces at each vertex, -1 where there is none."""
        label = np.full(self.n_vertices, -1, dtype=np.int64)
        for k in range(len(self.pieces))[::-1]:
            label[self.pieces[k].vertices] = k
        return label

    @property
    def hinges(self) -> NDArray[np.int64]:
        """Vertices shared by several pieces."""
        return np.flatnonzero(self.multiplicity > 1)

    @property
    def undetermined(self) -> NDArray[np.int64]:
        """Vertices of no triangle."""
        return np.flatnonzero(self.multiplicity == 0)

    @cached_property
    def bare_edges(self) -> NDArray[np.int64]:
        """Rows of `edges` that belong to no triangle."""
        bare = np.ones(len(self.edges), dtype=bool)
        for piece in self.pieces:
            bare[piece.edge_rows] = False
        return np.flatnonzero(bare)

    @property
    def n_holes(self) -> int:
        """Bounded components of the complement, summed over pieces."""
        return sum(piece.n_holes for piece in self.pieces)
