"""Pieces put together to one mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..topology import Polygons, Topology
from ..topology.surface import Together


@dataclass(frozen=True, eq=False)
class JoinedMesh:
    """All pieces in the numbering of the matrix."""

    points: NDArray[np.float64]  # (n, 2) NaN for vertices of no piece
    triangles: NDArray[np.int64]  # (m, 3) counter-clockwise; those of divided polygons included
    in_polygon: NDArray[np.bool_]  # (m,) triangles that are part of a polygon
    polygons: Polygons  # counter-clockwise
    component: NDArray[np.int64]  # (n,) piece of each point, the lowest at hinges, -1 for none
    scale: NDArray[np.float64]  # (number of pieces,)
    boundary: NDArray[np.int64]  # (b, 2) directed edges with the mesh on their left, loop by loop
    boundary_offsets: NDArray[np.int64]  # (loops + 1,)

    def fields(self, *, triangulate: bool = False) -> dict[str, Any]:
        """What every planar mesh's recovery says of cells, pieces and boundary; polygons in triangles on request."""
        polygons = Polygons.none() if triangulate else self.polygons
        return {
            "triangles": self.triangles if triangulate else self.triangles[~self.in_polygon],
            "component": self.component,
            "scale": self.scale,
            "polygons_offsets": polygons.offsets,
            "polygons_data": polygons.vertices,
            "boundary": self.boundary,
            "boundary_offsets": self.boundary_offsets,
        }

    @classmethod
    def of(cls, topology: Topology, placed: list[NDArray], scale: NDArray) -> JoinedMesh:
        """Join pieces at positions `placed`, turning over those that are mirrored."""
        pieces = Together(topology.pieces)
        z = np.concatenate(placed)
        points = np.full((topology.n_vertices, 2), np.nan)  # the first piece at a hinge comes last
        points[pieces.vertices[::-1]] = np.column_stack([z.real, z.imag])[::-1]
        a, b, c = z[pieces.triangles].T
        mirrored = np.bincount(pieces.triangle_piece, (np.conj(b - a) * (c - a)).imag, len(placed)) < 0
        turned = mirrored[pieces.triangle_piece, None]
        triangles = np.where(turned, pieces.triangles[:, [0, 2, 1]], pieces.triangles)
        boundary, lengths = [], []
        for piece, over in zip(topology.pieces, mirrored, strict=True):
            own, size = piece.vertices[piece.boundary], np.diff(piece.loop_offsets)
            boundary.append(own[::-1, ::-1] if over else own)
            lengths.append(size[::-1] if over else size)
        vanished = np.zeros(len(topology.edges), dtype=bool)
        vanished[topology.vanished] = True
        diagonal = vanished[pieces.edge_rows] & pieces.inner
        in_polygon, polygons = np.asarray(diagonal[pieces.opposite].any(axis=1)), topology.polygons
        if in_polygon.sum() != (polygons.size - 2).sum():  # some have no outline, as where cells do not fit
            in_polygon, polygons = np.zeros_like(in_polygon), Polygons.none()
        return cls(
            points=points,
            triangles=pieces.vertices[triangles],
            in_polygon=in_polygon,
            polygons=polygons.counter_clockwise(points),
            component=topology.component,
            scale=scale,
            boundary=np.concatenate(boundary),
            boundary_offsets=np.append(0, np.cumsum(np.concatenate(lengths))),
        )
