"""Everything that can be a cell in an embedding, faces and corners; and what other embeddings have.

Where parts of a graph hang together by two vertices or one it has many embeddings, and cells that are faces of one are
none of another. That matters near the last wrong labels only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...tolerances import LITTLE
from ...topology import Polygons
from ...topology.cycles import three_cycles
from ...topology.faces import FaceComplex, joined
from ...topology.numbering import adjacency
from .angles import SHORT, face_sums, facing_angles, likeliest_scale, outer_faces, vertex_excess


@dataclass(frozen=True, eq=False)
class Candidates:
    """Cells that a graph may have; a labelling is any set of them that shares no half-edge."""

    n_vertices: int
    edges: NDArray[np.int64]  # (e, 2) pairs i < j in lexicographic order
    weights: NDArray[np.float64]  # (e,) -A_ij of each edge
    scale: float | None  # c, where it is known
    cells: Polygons
    # (cells,) triangles a-b-c of two edges a-b, b-c; the third has vanished from the boundary, which it does if the
    # angle at b is a right one
    corner: NDArray[np.bool_]
    embedding: FaceComplex
    relative: NDArray[np.float64]  # (e,) the weights over c, or over the likeliest c, from the angles
    sides: NDArray[np.int64]  # (s, 2) pairs (cell, half-edge) of what each cell takes up
    belief: NDArray[np.float64]  # (cells,) from the angles: 1 for a certain cell, 0 for a certain hole, about
    first: NDArray[np.bool_]  # (cells,) the faces that make the likeliest labelling without vanished boundary edges
    outer: NDArray[np.bool_]  # (cells,) the face of each block that bounds it from outside
    # (e,) standard deviations of the errors of the weights, where they are known
    errors: NDArray[np.float64] | None

    @classmethod
    def of(
        cls, embedding: FaceComplex, weights: NDArray, scale: float | None = None, errors: NDArray | None = None
    ) -> Candidates:
        """All candidates of one embedding of the graph."""
        blocks = embedding.split()
        relative = weights / (scale or likeliest_scale(blocks, weights))
        angles = np.repeat(facing_angles(relative), 2)
        sums = face_sums(blocks, angles)
        outer = outer_faces(blocks, sums)
        faces = np.flatnonzero(blocks.simple)
        empty = (blocks.size > SHORT) | outer | ~blocks.simple
        corners, taken = _corners_of(blocks.joined(empty), empty[blocks.face])
        excess = vertex_excess(blocks, angles)[corners[:, 1]]
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
            cells=Polygons(np.append(0, np.cumsum(size)), np.r_[blocks.tail[blocks.order[chosen]], corners.ravel()]),
            corner=np.arange(len(size)) >= len(faces),
            embedding=embedding,
            relative=relative,
            sides=np.concatenate([of_faces, taken + [len(faces), 0]]),
            belief=np.r_[1 - np.abs(sums[faces] / np.pi - 1), 0.5 - np.abs(excess) / np.pi],
            first=np.r_[(blocks.size <= SHORT)[faces] & ~outer[faces], none],
            outer=np.r_[outer[faces], none],
        )

    @property
    def count(self) -> int:
        """Number of cells."""
        return self.cells.count

    def with_more(self, cells: Sequence[Sequence[int]]) -> Candidates:
        """With further cells, which claim no half-edges."""
        more = np.zeros(len(cells), dtype=bool)
        return replace(
            self,
            cells=Polygons.joined([self.cells, Polygons.of(cells)]) if len(cells) else self.cells,
            corner=np.append(self.corner, more),
            belief=np.append(self.belief, np.zeros(len(cells))),
            first=np.append(self.first, more),
            outer=np.append(self.outer, more),
        )

    @property
    def triangles(self) -> NDArray[np.bool_]:
        """(cells,) faces of three edges, but for outer ones."""
        return self.first & (self.cells.size == 3)

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


def _corners_of(embedding: FaceComplex, outside: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Corners a-b-c, (k, 3), of which a-c is no edge, and pairs (corner, half-edge) of what each takes up as a cell.

    The side of a triangle that faces a right angle has the weight cot(pi / 2) / 2 = 0, and on the boundary no other
    triangle adds to it: such an entry is often not stored, and the triangle shows as two edges only. They lie along the
    half-edges `outside`, (2 e,) bool, those of empty faces.

    Where nothing else meets at b, a face beyond both edges would contain the vanished side as a diagonal: the
    corner takes up the far sides as well, if they belong to such a face.
    """
    n, one = embedding.n_vertices, np.flatnonzero(outside)
    other = embedding.successor[one]
    a, b, c = embedding.tail[one], embedding.head[one], embedding.head[other]
    apart = (a != c) & ~joined(n, embedding.edges, a, c)
    halves, vertices = np.column_stack([one, other])[apart], np.column_stack([a, b, c])[apart]
    near = np.column_stack([np.repeat(np.arange(len(halves)), 2), halves.ravel()])
    lone = np.bincount(embedding.tail, minlength=n)[vertices[:, 1]] == 2
    lone &= ~outside[halves[:, 0] ^ 1]
    far = np.column_stack([np.repeat(np.flatnonzero(lone), 2), halves[lone].ravel() ^ 1])
    return vertices, np.concatenate([near, far])


def widened(candidates: Candidates, edges: NDArray[np.int64], misfit: NDArray[np.float64]) -> Candidates:
    """With 3-cycles and corners about the places where a labelling does not fit, in both orientations.

    `edges` (e, 2); `misfit` (e,): what a labelling leaves on these edges.
    """
    n, at = candidates.n_vertices, np.zeros(candidates.n_vertices)
    np.maximum.at(at, edges.ravel(), np.repeat(misfit, 2))
    near = at > LITTLE * at.max(initial=0.0)
    triangles, _ = three_cycles(n, candidates.edges)
    found = [triangles[near[triangles].any(axis=1)]]
    graph = adjacency(n, candidates.edges)
    for h in np.flatnonzero(near).tolist():
        ends = graph.indices[graph.indptr[h] : graph.indptr[h + 1]].astype(np.int64)
        if len(ends) <= 12:  # all pairs of these may make a corner
            one, other = ends[np.stack(np.triu_indices(len(ends), 1))]
            apart = ~joined(n, candidates.edges, one, other)
            found.append(np.column_stack([one, np.full(len(one), h), other])[apart])
    names = set(map(frozenset, candidates.cells.cycles))
    new = [cell for cell in np.concatenate(found).tolist() if frozenset(cell) not in names]
    return candidates.with_more([*new, *(cell[::-1] for cell in new)])
