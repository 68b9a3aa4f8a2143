"""The same cells in other drawings.

Of the 3-cycles on one edge two can be faces, and a drawing settles which; where it is wrong a cell is not among the
candidates. All others can be found nevertheless, and then the misfit tells which drawing is the better one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...topology.redrawing import redrawn
from .candidates import Candidates
from .choosing import compatible


@dataclass(frozen=True, eq=False)
class Redrawing:
    """Candidates of another drawing, with one more 3-cycle among the faces.

    Attributes
    ----------
    candidates : Candidates
    same : (cells,) int64
        The number that each had before; -1 for new ones.
    new : (cells,) bool
        The 3-cycle.
    parts : list of (int, list of int)
        Faces of four edges that there were, and triangles that are halves of them.
    """

    candidates: Candidates
    same: NDArray[np.int64]
    new: NDArray[np.bool_]
    parts: list[tuple[int, list[int]]]

    @classmethod
    def of(cls, old: Candidates, new: Candidates, cycle: NDArray) -> Redrawing:
        """Candidates in a new drawing, and the number that each had in the old one."""
        names, same = new.names, old.numbers_of(new)
        place = {name: k for k, name in enumerate(names)}
        parts = []
        for quad in np.flatnonzero(old.chorded).tolist():
            corners = np.sort(old.cells.vertices[old.cells.offsets[quad] : old.cells.offsets[quad + 1]]).tolist()
            halves = [place[half, -1] for half in combinations(corners, 3) if (half, -1) in place]
            parts.append((quad, halves))
        is_new = np.zeros(len(names), dtype=bool)
        is_new[place[tuple(sorted(cycle.tolist())), -1]] = True
        return cls(new, np.where(new.outer, -1, same), is_new, parts)

    def carried(self, labels: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Labels in the new drawing; the new face is a cell."""
        carried = np.where(self.same >= 0, labels[self.same], self.new)
        for quad, halves in self.parts:
            if labels[quad]:
                carried[halves] = True
        return compatible(self.candidates, np.where(carried, 1.0 + self.new, -np.inf))


def redrawings(candidates: Candidates, first: NDArray) -> Iterator[Redrawing]:
    """Other drawings.

    Parameters
    ----------
    candidates : Candidates
    first : (n,) float64
        Cycles at vertices of high value are taken first.
    """
    for cycle, drawing in redrawn(candidates.drawing, first):
        yield Redrawing.of(candidates, candidates.drawn(drawing), cycle)
