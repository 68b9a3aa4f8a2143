"""A triangulated surface without coordinates: pieces, sides, ends, and what kind of surface each piece is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..topology.keys import Grouped
from ..topology.manifold import Cycles
from ..topology.numbering import connected, local_numbering
from ..topology.orientation import glue, orient
from .heron import angles


@dataclass(frozen=True, eq=False)
class SurfaceMesh:
    """Triangles glued along edges, at most two on each.

    Neighbours run along a common edge in opposite directions, in orientable pieces. A vertex has several fans where
    sheets of surface touch in it.
    """

    n: int
    edges: NDArray[np.int64]  # (e, 2) pairs i < j in lexicographic order; each is a side of a triangle
    triangles: NDArray[np.int64]  # (m, 3)
    opposite: NDArray[np.int64]  # (m, 3) rows of `edges` that face the corners
    piece: NDArray[np.int64]  # (m,) label of the edge-connected piece, in order of the pieces' lowest vertices
    orientable: NDArray[np.bool_]  # of each piece
    fan: NDArray[np.int64]  # (m, 3) label of the fan of triangles about a vertex that each corner belongs to
    boundary: NDArray[np.int64]  # (b,) rows of `edges` with a triangle on one side only

    @classmethod
    def of(cls, cycles: Cycles, chosen: NDArray[np.bool_] | slice = slice(None)) -> SurfaceMesh:
        """The surface that some of a graph's 3-cycles make."""
        triangles, opposite = cycles.triangles[chosen], cycles.opposite[chosen]
        gluing = glue(len(cycles.edges), opposite)
        flip, piece, orientable = orient(triangles, gluing)
        lowest = np.full(len(orientable), cycles.n)
        np.minimum.at(lowest, piece, triangles.min(axis=1))
        order = np.argsort(lowest, kind="stable")
        triangles = np.where(flip[:, None], triangles[:, [0, 2, 1]], triangles)
        opposite = np.where(flip[:, None], opposite[:, [0, 2, 1]], opposite)
        return cls(
            cycles.n, cycles.edges, triangles, opposite, np.argsort(order)[piece], orientable[order],
            _fans(triangles, opposite), np.flatnonzero(gluing.count == 1),
        )  # fmt: skip

    @property
    def n_pieces(self) -> int:
        """Number of edge-connected pieces."""
        return len(self.orientable)

    @property
    def piece_of_edge(self) -> NDArray[np.int64]:
        """(e,) label of each edge's piece."""
        label = np.empty(len(self.edges), np.int64)
        label[self.opposite] = self.piece[:, None]
        return label

    def pieces(self) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Rows (k,) of `edges` of each piece, neighbours near each other, and places (m, 3) in these facing corners."""
        edges, triangles = Grouped(self.piece_of_edge, self.n_pieces), Grouped(self.piece, self.n_pieces)
        place = np.empty(len(self.edges), np.int64)
        for label in range(self.n_pieces):
            rows = edges.order[edges.start[label] : edges.start[label + 1]]
            vertices, local = np.unique(self.edges[rows], return_inverse=True)
            rows = rows[local_numbering(len(vertices), local.reshape(-1, 2)).edge_rows]
            place[rows] = np.arange(len(rows))
            opposite = place[self.opposite[triangles.order[triangles.start[label] : triangles.start[label + 1]]]]
            yield rows, opposite[np.argsort(opposite.min(axis=1), kind="stable")]

    @property
    def euler(self) -> NDArray[np.int64]:
        """(number of pieces,) Euler characteristic, with fans for vertices."""
        count = self.n_pieces
        _, one = np.unique(self.fan, return_index=True)
        fans = np.bincount(self.piece[one // 3], minlength=count)
        return fans - np.bincount(self.piece_of_edge, minlength=count) + np.bincount(self.piece, minlength=count)

    @property
    def loop_of_boundary(self) -> NDArray[np.int64]:
        """(b,) label of the boundary loop of each boundary edge."""
        row, corner = np.nonzero(np.isin(self.opposite, self.boundary))
        order = np.argsort(self.opposite[row, corner])
        row, corner = row[order], corner[order]
        ends = self.fan[row, (corner + 1) % 3], self.fan[row, (corner + 2) % 3]
        size = int(self.fan.max(initial=-1)) + 1
        label = connected(size, *ends)[1][ends[0]]
        return np.unique(label, return_inverse=True)[1]

    @property
    def loops(self) -> NDArray[np.int64]:
        """(number of pieces,) boundary loops of each piece."""
        _, one = np.unique(self.loop_of_boundary, return_index=True)
        return np.bincount(self.piece_of_edge[self.boundary[one]], minlength=self.n_pieces)

    @property
    def component(self) -> NDArray[np.int64]:
        """(n,) the lowest label of the pieces at each vertex, -1 where there is none."""
        label = np.full(self.n, self.n_pieces)
        np.minimum.at(label, self.triangles.ravel(), np.repeat(self.piece, 3))
        return np.where(label == self.n_pieces, -1, label)

    @property
    def hinges(self) -> NDArray[np.int64]:
        """Vertices shared by several pieces."""
        pairs = np.unique(np.repeat(self.piece, 3) * self.n + self.triangles.ravel())
        return np.flatnonzero(np.bincount(pairs % self.n, minlength=self.n) > 1)

    def curvature(self, squared: NDArray) -> NDArray[np.float64]:
        """(n,) what the angles about each vertex lack of 2 pi, or of pi at the boundary; NaN where no triangle is.

        For squared edge lengths (e,). Where several sheets touch in a vertex theirs are added up. With v - e + m the
        Euler characteristic, and b = 2 e - 3 m the number of boundary edges, the sum over all vertices of a piece is
        2 pi v - pi b - pi m = 2 pi (v - e + m): Gauss and Bonnet, whatever the lengths.
        """
        total = np.bincount(self.triangles.ravel(), angles(squared[self.opposite]).ravel(), self.n)
        _, one = np.unique(self.fan, return_index=True)
        fans = np.bincount(self.triangles.ravel()[one], minlength=self.n)
        on_boundary = np.bincount(self.edges[self.boundary].ravel(), minlength=self.n)
        return np.where(fans > 0, 2 * np.pi * fans - np.pi / 2 * on_boundary - total, np.nan)


def _fans(triangles: NDArray, opposite: NDArray) -> NDArray[np.int64]:
    """(m, 3) labels of corners at one vertex that inner edges join."""
    side = np.concatenate([opposite, opposite], axis=1).ravel()  # the edge of each corner's first and second side
    corner = np.arange(opposite.size).reshape(-1, 3)
    ends = np.concatenate([corner[:, [1, 2, 0]], corner[:, [2, 0, 1]]], axis=1).ravel()
    vertex = triangles.ravel()[ends]
    order = np.lexsort((vertex, side))
    side, vertex, ends = side[order], vertex[order], ends[order]
    same = (side[1:] == side[:-1]) & (vertex[1:] == vertex[:-1])
    return connected(corner.size, ends[:-1][same], ends[1:][same])[1].reshape(-1, 3)
