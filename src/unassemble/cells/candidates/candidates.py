"""Everything that can be a cell: faces, and triangles whose third edge has vanished from the boundary."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...topology import Polygons
from ...topology.faces import FaceComplex, joined
from .angles import face_sums, facing_angles, likeliest_scale, overall_scale, vertex_excess
from .cell_set import CellSet
from .crossed_faces import CrossedFaces
from .crosses import Crosses
from .half_circles import HalfCircles
from .open_corners import OpenCorners
from .outer_faces import outer_faces
from .turning import Turns

FEW = 100
"""Vertices below which all is tried before the entries are blamed."""
_SHORT = 4  # faces of so many edges are cells unless the numbers say otherwise
_TURNED = 0.01  # belief that a corner loses by not being as drawn
_APART = 0.2  # difference of logarithms of two likely c that is worth trying both


@dataclass(frozen=True, eq=False)
class Candidates(CellSet):
    """Cells that a graph may have; any set of them that shares no half-edge is a reading of the graph.

    Corners are two consecutive edges of an empty face.

    Attributes
    ----------
    drawing : FaceComplex
        Of the graph.
    relative : (e,) float64
        The weights over c, or over the likeliest c, from the angles.
    sides : (s, 2) int64
        Pairs (cell, half-edge) of what each cell takes up.
    belief : (cells,) float64
        From the angles: 1 for a certain cell, 0 for a certain hole, about.
    rim_sum : (cells,) float64
        Angle sums of faces whose sides along outer ones have all of their weight; 0 for others.
    first : (cells,) bool
        The faces that make the likeliest reading without vanished boundary edges.
    outer : (cells,) bool
        The face of each block that bounds it from outside.
    strip : (cells,) bool
        Corners inside paths, all of them right angles if the path is a strip, none if pieces hang together there.
    half : (cells,) bool
        Cells on half circles, whose diameter has vanished from the boundary.
    crossed : (cells,) bool
        Faces of drawings with one part turned over.
    turns : Turns
        Parts that can be turned over; its corners are numbered after the faces.
    crosses : Crosses or None
        About which corners are right angles.
    wide : bool
        Whether there are unlikely ones among them, see :meth:`of`.
    """

    drawing: FaceComplex
    relative: NDArray[np.float64]
    sides: NDArray[np.int64]
    belief: NDArray[np.float64]
    rim_sum: NDArray[np.float64]
    first: NDArray[np.bool_]
    outer: NDArray[np.bool_]
    strip: NDArray[np.bool_]
    half: NDArray[np.bool_]
    crossed: NDArray[np.bool_]
    turns: Turns
    crosses: Crosses | None
    wide: bool

    @classmethod
    def of(
        cls,
        drawing: FaceComplex,
        weights: NDArray,
        scale: float | None = None,
        crosses: Crosses | None = None,
        guess: float | None = None,
        errors: NDArray | None = None,
        wide: bool = False,
    ) -> Candidates:
        """All candidates of one drawing of the graph; the corners about some crosses are right angles.

        `guess` is a c to judge angles by, where it is not known; `errors` are as in the class. If `wide`, there are
        corners in quadrilaterals, too, which may be a triangle and a hole, all half circles that do not fill more than
        a full turn, faces that turning a part over makes, and what is possible where many parts meet in a vertex.
        """
        blocks = drawing.split()
        relative = weights / (scale or (crosses and crosses.scale) or guess or likeliest_scale(blocks, weights))
        angles = np.repeat(facing_angles(relative), 2)
        sums = face_sums(blocks, angles)
        outer = outer_faces(blocks, sums, relative)
        faces = np.flatnonzero(blocks.simple)
        rim = outer[blocks.face[np.arange(len(angles)) ^ 1]]
        rim_sums = face_sums(blocks, facing_angles(np.repeat(relative, 2) * np.where(rim, 2, 1)))
        outside = (blocks.size > _SHORT) | outer | ~blocks.simple
        # How parts hang together at crosses is known, and at other vertices a guess.
        whole = blocks.joined(outside) if crosses is None else drawing
        long = outside[blocks.face]
        outside |= wide & (blocks.size == _SHORT)
        corners = OpenCorners.of(whole, outside[blocks.face], long if wide else None)
        about = vertex_excess(blocks, angles)
        halves = HalfCircles.of(whole, outside[blocks.face], corners, relative, angles, about, wide=wide)
        crossed = CrossedFaces.of(blocks) if wide else CrossedFaces.none()
        crossed_sums = np.bincount(crossed.sides[:, 0], angles[crossed.sides[:, 1]], len(crossed))
        size = np.r_[blocks.size[faces], np.full(len(corners), 3), halves.size, crossed.size]
        others, none = len(corners) + len(halves) + len(crossed), np.zeros(len(size), dtype=bool)
        chosen = np.isin(blocks.face[blocks.order], faces)
        number = np.full(len(blocks.size), -1)
        number[faces] = np.arange(len(faces))
        excess = about[corners.vertices[:, 1]]
        belief = np.where(corners.in_strip, 1.0, 0.5 - np.abs(excess) / np.pi) - np.where(corners.turned, _TURNED, 0.0)
        if crosses is not None:
            belief[np.isin(corners.vertices[:, 1], crosses.hub) & ~corners.turned] = 1.0
        return cls(
            n_vertices=drawing.n_vertices,
            edges=drawing.edges,
            drawing=drawing,
            weights=weights,
            scale=scale,
            errors=errors,
            relative=relative,
            cells=Polygons(
                np.append(0, np.cumsum(size)),
                np.r_[
                    blocks.tail[blocks.order[chosen]],
                    corners.vertices.ravel(),
                    halves.vertices,
                    crossed.vertices,
                ],
            ),
            sides=np.concatenate(
                [
                    np.column_stack([number[blocks.face[blocks.order[chosen]]], blocks.order[chosen]]),
                    corners.sides + [len(faces), 0],
                    halves.sides + [len(faces) + len(corners), 0],
                    crossed.sides + [len(size) - len(crossed), 0],
                ]
            ),
            belief=np.r_[
                1 - np.abs(sums[faces] / np.pi - 1),
                belief,
                0.5 - _TURNED * halves.turned,
                1 - np.abs(crossed_sums / np.pi - 1) - _TURNED,
            ],
            rim_sum=np.r_[rim_sums[faces], np.zeros(others)],
            first=np.r_[(blocks.size <= _SHORT)[faces] & ~outer[faces], none[:others]],
            outer=np.r_[outer[faces], none[:others]],
            corner=np.r_[none[: len(faces)], np.ones(len(corners), bool), none[: len(halves) + len(crossed)]],
            strip=np.r_[none[: len(faces)], corners.in_strip, none[: len(halves) + len(crossed)]],
            half=np.r_[none[: len(faces) + len(corners)], np.ones(len(halves), bool), none[: len(crossed)]],
            crossed=np.arange(len(size)) >= len(size) - len(crossed),
            turns=corners.turns,
            crosses=crosses,
            wide=wide,
        )

    def drawn(self, drawing: FaceComplex, guess: float | None = None) -> Candidates:
        """Those of another drawing, with angles judged by the same c, or by a guess."""
        guess = self.judged_by if guess is None else guess
        return Candidates.of(drawing, self.weights, self.scale, guess=guess, errors=self.errors, wide=self.wide)

    def widened(self, labels: NDArray[np.bool_], guess: float | None = None) -> tuple[Candidates, NDArray[np.bool_]]:
        """More candidates in the same drawing, for a likelier c, and the labels of what there was before."""
        wide = Candidates.of(self.drawing, self.weights, self.scale, self.crosses, guess, self.errors, wide=True)
        same = self.numbers_of(wide)
        return wide, (same >= 0) & labels[same]

    def numbers_of(self, others: Candidates) -> NDArray[np.int64]:
        """(cells,) number here of each of the others; -1 of those that are none here."""
        return np.array([self._number.get(name, -1) for name in others.names], dtype=np.int64)

    @cached_property
    def _number(self) -> dict[tuple[tuple[int, ...], int], int]:
        return {name: k for k, name in enumerate(self.names)}

    @cached_property
    def names(self) -> list[tuple[tuple[int, ...], int]]:
        """Vertices of each candidate, and the apex of corners."""
        apex = np.where(self.corner, self.cells.vertices[self.cells.offsets[:-1] + 1], -1).tolist()
        return [
            (tuple(sorted(cell.tolist())), k)
            for cell, k in zip(np.split(self.cells.vertices, self.cells.offsets[1:-1]), apex, strict=True)
        ]

    def other_scale(self) -> float | None:
        """A likely c that differs much from the one that angles are judged by; None if there is none."""
        blocks = self.drawing.split()
        angles = np.repeat(facing_angles(self.relative), 2)
        ratio = overall_scale(blocks, self.relative, outer_faces(blocks, face_sums(blocks, angles), self.relative))
        return None if abs(np.log(ratio)) < _APART else ratio * self.judged_by

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
    def chorded(self) -> NDArray[np.bool_]:
        """(cells,) faces of four edges with an edge between opposite vertices: parts of two cells, if any of one."""
        chorded = np.zeros(self.count, dtype=bool)
        quads = np.flatnonzero(self.size == 4)
        a, b, c, d = (self.cells.vertices[self.cells.offsets[quads] + k] for k in range(4))
        chorded[quads] = joined(self.n_vertices, self.edges, a, c) | joined(self.n_vertices, self.edges, b, d)
        return chorded

    @cached_property
    def conflicts(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Half-edges that several candidates want: `sides` of these, sorted by half-edge, and where each run starts."""
        order = np.argsort(self.sides[:, 1], kind="stable")
        start = np.flatnonzero(np.diff(self.sides[order, 1], prepend=-1))
        return self.sides[order], np.append(start, len(order))

    def turned(self, labels: NDArray[np.bool_]) -> Iterator[NDArray[np.bool_]]:
        """Labels with one part of the drawing turned over, where that changes any."""
        for corners in self.turns.turned(labels[self.corner]):
            turned = labels.copy()
            turned[self.corner] = corners
            yield turned
