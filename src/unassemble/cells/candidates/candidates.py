"""Everything that can be a cell in an embedding: faces, and corners."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...topology import Polygons
from ...topology.faces import FaceComplex
from .angles import SHORT, face_sums, facing_angles, likeliest_scale, vertex_excess
from .cell_set import CellSet
from .corners import Corners
from .outer_faces import outer_faces


@dataclass(frozen=True, eq=False)
class Candidates(CellSet):
    """Cells that a graph may have; a labelling is any set of them that shares no half-edge.

    Attributes
    ----------
    embedding : FaceComplex
    relative : (e,) float64
        The weights over c, or over the likeliest c, from the angles.
    sides : (s, 2) int64
        Pairs (cell, half-edge) of what each cell takes up.
    belief : (cells,) float64
        From the angles: 1 for a certain cell, 0 for a certain hole, about.
    first : (cells,) bool
        The faces that make the likeliest labelling without vanished boundary edges.
    outer : (cells,) bool
        The face of each block that bounds it from outside.
    """

    embedding: FaceComplex
    relative: NDArray[np.float64]
    sides: NDArray[np.int64]
    belief: NDArray[np.float64]
    first: NDArray[np.bool_]
    outer: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        embedding: FaceComplex,
        weights: NDArray,
        scale: float | None = None,
        errors: NDArray | None = None,
    ) -> Candidates:
        """All candidates of one embedding of the graph."""
        blocks = embedding.split()
        relative = weights / (scale or likeliest_scale(blocks, weights))
        angles = np.repeat(facing_angles(relative), 2)
        sums = face_sums(blocks, angles)
        outer = outer_faces(blocks, sums)
        faces = np.flatnonzero(blocks.simple)
        empty = (blocks.size > SHORT) | outer | ~blocks.simple
        corners = Corners.of(blocks.joined(empty), empty[blocks.face])
        excess = vertex_excess(blocks, angles)[corners.vertices[:, 1]]
        chosen = np.isin(blocks.face[blocks.order], faces)
        number = np.full(len(blocks.size), -1)
        number[faces] = np.arange(len(faces))
        of_faces = np.column_stack([number[blocks.face[blocks.order[chosen]]], blocks.order[chosen]])
        size = np.r_[blocks.size[faces], np.full(len(corners), 3)]
        none = np.zeros(len(corners), dtype=bool)
        return cls(
            n_vertices=embedding.n_vertices,
            edges=embedding.edges,
            weights=weights,
            scale=scale,
            errors=errors,
            cells=Polygons(
                np.append(0, np.cumsum(size)), np.r_[blocks.tail[blocks.order[chosen]], corners.vertices.ravel()]
            ),
            corner=np.arange(len(size)) >= len(faces),
            embedding=embedding,
            relative=relative,
            sides=np.concatenate([of_faces, corners.sides + [len(faces), 0]]),
            belief=np.r_[1 - np.abs(sums[faces] / np.pi - 1), 0.5 - np.abs(excess) / np.pi],
            first=np.r_[(blocks.size <= SHORT)[faces] & ~outer[faces], none],
            outer=np.r_[outer[faces], none],
        )

    @property
    def judged_by(self) -> float:
        """The c that angles are judged by."""
        given = np.flatnonzero(self.weights)[0]
        return float(self.weights[given] / self.relative[given])

    @property
    def triangles(self) -> NDArray[np.bool_]:
        """(cells,) faces of three edges, but for outer ones."""
        return self.first & (self.size == 3)

    @property
    def triangle_sides(self) -> NDArray[np.int64]:
        """(m, 3) edges of each of these."""
        cell, half = self.sides.T
        return half[self.triangles[cell]].reshape(-1, 3) >> 1

    @cached_property
    def conflicts(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Half-edges that several candidates want: `sides` of these, sorted by half-edge, and where each run starts."""
        order = np.argsort(self.sides[:, 1], kind="stable")
        start = np.flatnonzero(np.diff(self.sides[order, 1], prepend=-1))
        return self.sides[order], np.append(start, len(order))
