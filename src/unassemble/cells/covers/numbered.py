"""Cells with the cotangents of their angles, where few different ones occur.

An edge has one cotangent or the sum of two. Where many cells have the same shape, as in lattices, their cotangents are
few numbers that can be told from single entries: that an edge borders one cell only gives its cotangent, two in a
triangle, or three in a quadrilateral, give the other one, and what it leaves of the weight of its edge is the
cotangent on the far side. The numbers that most edges would have are tried on all of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...topology.keys import contains, distinct
from ..candidates.angles import facing_angles
from .shapes import Shapes

AGREE = 1e-7
"""Relative difference of equal numbers, and of sums of angles, if entries have no errors."""

_MOST_CHOICES = 4_000_000


@dataclass(frozen=True, eq=False)
class Numbered:
    """Cells, each with one choice of cotangents; every choice is met by others on the far sides of its edges.

    Attributes
    ----------
    shapes : Shapes
    cell : (m,) int64
        Row of `shapes`.
    angles : (m, 4) float64
        Angle that faces each side: a right one faces the vanished side of a corner, 0 stands where there is no side.
    column : (m, 4) int64
        Which of the numbers of its edge each stored side has; -1 elsewhere.
    far : (e, p) int64
        Which of the same edge's numbers the far side of each has; -1 for none.
    """

    shapes: Shapes
    cell: NDArray[np.int64]
    angles: NDArray[np.float64]
    column: NDArray[np.int64]
    far: NDArray[np.int64]

    @classmethod
    def of(cls, shapes: Shapes, cotangents: NDArray, numbers: NDArray, agree: float = AGREE) -> Numbered | None:
        """All that fit; None if some edge is left without a cell, or there are too many.

        Parameters
        ----------
        shapes : Shapes
        cotangents : (e,) float64
            Sums of the cotangents of the angles facing each edge, 2 w.
        numbers : (e, p) float64
            What a side of each edge may have, beside all of the sum; NaN for none.
        agree : float
            Relative difference of equal numbers, and of sums of angles.
        """
        value = _values(cotangents, numbers, agree)
        p = value.shape[1]
        if len(shapes) * p**4 > _MOST_CHOICES:
            return None
        angle = np.where(shapes.stored[..., None], facing_angles(value)[shapes.sides], np.nan)
        angle[..., 0] = np.where(shapes.stored, angle[..., 0], 0.0)
        angle[shapes.corner, 2, 0] = np.pi / 2
        a, b, c, d = (angle[:, k] for k in range(4))
        two, other = a[:, :, None] + b[:, None, :], c[:, :, None] + d[:, None, :]
        sums = two[:, :, :, None, None] + other[:, None, None, :, :]
        cell, *columns = np.nonzero(np.abs(sums - np.pi) < agree)
        column = np.column_stack(columns)
        chosen = angle[cell[:, None], np.arange(4), column]
        far = _partners(cotangents, value, agree)
        found = cls(shapes, cell, chosen, np.where(shapes.stored[cell], column, -1), far)._met()
        bare = np.bincount(found.edge[found.slot >= 0], minlength=len(cotangents)) == 0
        return None if bare.any() else found

    @property
    def edge(self) -> NDArray[np.int64]:
        """(m, 4) row of the edge of each side; -1 where it has none."""
        return self.shapes.sides[self.cell]

    @property
    def slot(self) -> NDArray[np.int64]:
        """(m, 4) edge * p + number of each side; -1 where it has none."""
        return np.where(self.column >= 0, self.edge * self.far.shape[1] + self.column, -1)

    @property
    def cotangents(self) -> NDArray[np.float64]:
        """(m, 4) of the angles, 0 where there is no side."""
        return np.where(self.column >= 0, 1 / np.tan(np.where(self.angles > 0, self.angles, 1.0)), 0.0)

    @property
    def corner_angles(self) -> NDArray[np.float64]:
        """(m, 4) of each cell at its vertices; 0 where there is none."""
        before = np.take_along_axis(self.angles, self.shapes.before[self.cell], axis=1)
        return np.where(self.shapes.vertices[self.cell] >= 0, np.pi - self.angles - before, 0.0)

    def _met(self) -> Numbered:
        """Those all of whose sides are all of their edges' weights, or find the rest on another cell; in rounds."""
        found = self
        while True:
            slot, cell = found.slot, found.cell
            count = len(found.shapes)
            partner = np.where(slot >= 0, found.far.ravel()[slot], -1)
            wanted = np.where(partner >= 0, slot - found.column + partner, -1)
            pairs = distinct((slot * count + cell[:, None])[slot >= 0])
            cells = np.bincount(pairs // count, minlength=found.far.size)
            own = contains(pairs, wanted * count + cell[:, None])
            met = (slot < 0) | (found.column == 0) | ((partner >= 0) & (cells[wanted] > own))
            kept = met.all(axis=1)
            if kept.all():
                return found
            found = replace(found, cell=cell[kept], angles=found.angles[kept], column=found.column[kept])


def frequent_numbers(shapes: Shapes, cotangents: NDArray, most: int, agree: float = AGREE) -> NDArray[np.float64]:
    """Cotangents that many edges would have if all others bordered one cell only, the most frequent first.

    Parameters
    ----------
    shapes : Shapes
    cotangents : (e,) float64
        Sums of the cotangents of the angles facing each edge.
    most : int
    agree : float
        As for :meth:`Numbered.of`.
    """
    angle = np.where(shapes.stored, facing_angles(cotangents)[shapes.sides], 0.0)
    angle[shapes.corner, 2] = np.pi / 2
    rest = np.pi - angle.sum(axis=1, keepdims=True) + angle
    usable = shapes.stored & (rest > agree) & (rest < np.pi - agree)
    edge = shapes.sides[usable]
    near = 1 / np.tan(rest[usable])
    every = np.arange(len(cotangents))
    value = np.concatenate([cotangents, cotangents / 2, near, cotangents[edge] - near])
    edge = np.concatenate([every, every, edge, edge])
    order = np.argsort(value)
    value, edge = value[order], edge[order]
    run = np.cumsum(np.diff(value, prepend=value[:1]) > agree * (1 + np.abs(value)))
    count = np.bincount(distinct(run * len(cotangents) + edge) // len(cotangents))
    first = np.flatnonzero(np.diff(run, prepend=-1))
    return np.asarray(value[first[np.argsort(-count, kind="stable")[:most]]])


def _values(cotangents: NDArray, numbers: NDArray, agree: float) -> NDArray[np.float64]:
    """(e, 1 + p) what a side of each edge may have: all of it, or a number, if the rest is another one."""
    rest = cotangents[:, None] - numbers
    bound = agree * (1 + np.abs(numbers))
    known = (np.abs(rest[:, :, None] - numbers[:, None, :]) < bound[:, None, :]).any(axis=2)
    known |= np.abs(numbers) < agree  # a right angle, across which another cell has all of the sum
    first = np.triu(np.abs(numbers[:, :, None] - numbers[:, None, :]) < bound[:, None, :], 1).any(axis=1)
    known &= ~first & ~(np.abs(rest) < bound)
    return np.column_stack([cotangents, np.where(known, numbers, np.nan)])


def _partners(cotangents: NDArray, value: NDArray, agree: float) -> NDArray[np.int64]:
    """(e, p) column of what is left of the sum by each value; -1 where none of them is."""
    rest = cotangents[:, None] - value
    same = np.abs(rest[:, :, None] - value[:, None, :]) < agree * (1 + np.abs(rest[:, :, None]))
    return np.where(same.any(axis=2), same.argmax(axis=2), -1)
