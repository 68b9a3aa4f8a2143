"""Pieces put together to one mesh."""

import numpy as np
from numpy.typing import NDArray

from ..recovery import PlanarMesh
from ..topology import Polygons, Topology
from ..topology.surface import Together


def joined(topology: Topology, placed: list[NDArray], scale: NDArray, operator: str) -> PlanarMesh:
    """Pieces of linear triangles at positions `placed`, (k,) each, those that are mirrored turned over.

    NaN for vertices of no piece; `scale` (pieces,): c of each, or more where these have regions.
    """
    pieces = Together(topology.pieces)
    z = np.concatenate(placed)
    points = np.full((topology.n_vertices, 2), np.nan)  # the first piece at a hinge comes last
    points[pieces.vertices[::-1]] = np.column_stack([z.real, z.imag])[::-1]
    a, b, c = z[pieces.triangles].T
    mirrored = np.bincount(pieces.triangle_piece, (np.conj(b - a) * (c - a)).imag, len(placed)) < 0
    turned = mirrored[pieces.triangle_piece, None]
    triangles = pieces.vertices[np.where(turned, pieces.triangles[:, [0, 2, 1]], pieces.triangles)]
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
    polygons = polygons.counter_clockwise(points)
    return PlanarMesh(
        points=points,
        triangles=triangles[~in_polygon],
        polygons_offsets=polygons.offsets,
        polygons_data=polygons.vertices,
        component=topology.component,
        hinges=topology.hinges,
        scale=scale,
        boundary=np.concatenate(boundary),
        boundary_offsets=np.append(0, np.cumsum(np.concatenate(lengths))),
        operator=operator,
        n_holes=topology.n_holes,
    )
