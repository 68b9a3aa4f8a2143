"""How many readings may be solved."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...planar.piece import PieceMesh
from ..reading import C, Reading

SMALL_GRAPH = 1000
"""Vertices up to which all drawings are begun with before one is repaired, and labels relaxed first."""
_WORK = 1.2e5  # vertices times solves that repairs may take altogether
_SOLVES = 360
_MANY = 20  # pieces that cost as much as another solve


@dataclass
class Effort:
    """Solves that are left; all drawings and starts share them, so that input without a mesh is soon given up."""

    solves: int
    known: dict[bytes, PieceMesh | None] = field(default_factory=dict)

    @classmethod
    def for_graph(cls, n: int, part: float = 1.0) -> Effort:
        """As much as a graph of n vertices is worth, or a part of it."""
        return cls(int(part * np.clip(_WORK / n, 12, _SOLVES)))

    def reading(self, candidates: C, labels: NDArray[np.bool_]) -> Reading[C]:
        """A reading, counted."""
        reading = Reading.of(candidates, labels, self.known)
        self.solves -= 1 + len(reading.pieces) // _MANY
        return reading

    def share(self, part: float) -> Effort:
        """A part of what is left."""
        solves = int(self.solves * part)
        self.solves -= solves
        return Effort(solves, self.known)

    @property
    def spent(self) -> bool:
        """Whether it is time to give up."""
        return self.solves <= 0

    def progress(self, reading: Reading, patience: int) -> Progress:
        """Of repairs that begin with a reading and may go on for some solves in any case."""
        return Progress(self, reading.size, self.solves, patience)


@dataclass(frozen=True)
class Progress:
    """Whether repairs are worth going on with.

    The squared misfit is about proportional to the number of wrong cells. Had it to go on falling as it has since the
    beginning, the solves that are left must do.

    Attributes
    ----------
    effort : Effort
    size : float
        Of the misfit at the beginning.
    solves : int
        That were left then.
    patience : int
        Solves after which progress is asked for.
    """

    effort: Effort
    size: float
    solves: int
    patience: int

    def suffices(self, size: float) -> bool:
        """Whether the misfit, now `size`, would be gone in time."""
        used = self.solves - self.effort.solves
        if self.effort.spent or used <= self.patience:
            return not self.effort.spent
        return (self.size**2 - size**2) * self.effort.solves > size**2 * used
