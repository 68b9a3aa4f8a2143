"""Pieces put together to one mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .topology import Polygons, Topology


@dataclass(frozen=True, eq=False)
class JoinedMesh:
    """All pieces in the numbering of the matrix.

    Attributes
    ----------
    points : (n, 2) float64
        NaN for vertices of no piece.
    triangles : (m, 3) int64
        Counter-clockwise; those of divided polygons included.
    triangle_piece : (m,) int64
    in_polygon : (m,) bool
        Triangles that are part of a polygon.
    polygons : Polygons
        Counter-clockwise.
    component : (n,) int64
        Piece of each point, the lowest at hinges, -1 for none.
    scale : (number of pieces,) float64
    boundary : (b, 2) int64
        Directed edges with the mesh on their left, loop by loop.
    boundary_offsets : (loops + 1,) int64
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    triangle_piece: NDArray[np.int64]
    in_polygon: NDArray[np.bool_]
    polygons: Polygons
    component: NDArray[np.int64]
    scale: NDArray[np.float64]
    boundary: NDArray[np.int64]
    boundary_offsets: NDArray[np.int64]

    @classmethod
    def of(cls, topology: Topology, placed: list[NDArray], scale: NDArray) -> JoinedMesh:
        """Join pieces at positions `placed`, turning over those that are mirrored."""
        points = np.full((topology.n_vertices, 2), np.nan)
        component = np.full(topology.n_vertices, -1, dtype=np.int64)
        triangles, divided, boundaries, lengths = [], [], [], []
        vanished = np.zeros(len(topology.edges), dtype=bool)
        vanished[topology.vanished] = True
        for label, (piece, z) in reversed(list(enumerate(zip(topology.pieces, placed, strict=True)))):
            points[piece.vertices] = np.column_stack([z.real, z.imag])
            component[piece.vertices] = label
        for piece, z in zip(topology.pieces, placed, strict=True):
            a, b, c = z[piece.triangles].T
            mirrored = float((np.conj(b - a) * (c - a)).imag.sum()) < 0
            local = piece.triangles[:, [0, 2, 1]] if mirrored else piece.triangles
            ring = piece.boundary[::-1, ::-1] if mirrored else piece.boundary
            triangles.append(piece.vertices[local])
            diagonal = vanished[piece.edge_rows] & (piece.facing[:, 1] >= 0)
            divided.append(diagonal[piece.opposite].any(axis=1))
            boundaries.append(piece.vertices[ring])
            loop_lengths = np.diff(piece.loop_offsets)
            lengths.append(loop_lengths[::-1] if mirrored else loop_lengths)
        return cls(
            points=points,
            triangles=np.concatenate(triangles),
            triangle_piece=np.repeat(np.arange(len(placed)), [len(t) for t in triangles]),
            in_polygon=np.concatenate(divided),
            polygons=topology.polygons.counter_clockwise(points),
            component=component,
            scale=scale,
            boundary=np.concatenate(boundaries),
            boundary_offsets=np.append(0, np.cumsum(np.concatenate(lengths))),
        )
