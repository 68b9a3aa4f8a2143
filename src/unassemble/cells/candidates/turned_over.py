"""Drawings whose faces have the angles of cells, by parts of the graph turned over.

A part that hangs on two vertices can be drawn in two ways, and the faces on both sides of it are cells in one of them
only. Their angles tell which before anything is solved.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ...topology.turning_over import turned_over, turns
from .candidates import Candidates
from .choosing import chosen
from .starts import likely_readings
from .strain import strain

_MOST_TURNS = 40  # that are looked at in one drawing
_MOST_ROUNDS = 8  # parts that are turned over at most
_LESS = 1e-6  # strain, relative, of drawings that are not the same


def with_less_strain(candidates: Candidates) -> Candidates | None:
    """Candidates of the drawing that turning parts over, each for less strain, leads to; None where none does."""
    first = best = candidates.drawn(candidates.drawing.split())
    least = _strain(best)
    for _ in range(_MOST_ROUNDS):
        drawing = best.drawing
        others = [candidates.drawn(turned_over(drawing, turn)) for turn in islice(turns(drawing), _MOST_TURNS)]
        strains = [_strain(other) for other in others]
        if not others or min(strains) >= (1 - _LESS) * least:
            break
        least = min(strains)
        best = others[int(np.argmin(strains))]
    return None if best is first else best


def with_a_part_turned_over(
    candidates: Candidates, labels: NDArray[np.bool_], guess: float
) -> Iterator[tuple[Candidates, NDArray[np.bool_]]]:
    """Candidates of each drawing with one part turned over, and the labels of those that were candidates before.

    Cells that there are no more leave edges bare, which others take up. `guess` is a c to judge angles by.
    """
    drawing = candidates.drawing.split()
    for turn in islice(turns(drawing), _MOST_TURNS):
        other = candidates.drawn(turned_over(drawing, turn), guess)
        same = candidates.numbers_of(other)
        yield other, chosen(other, np.where((same >= 0) & labels[same], 1.0, -np.inf))


def _strain(candidates: Candidates) -> float:
    """Of the first choice of cells."""
    labels = next(likely_readings(candidates), None)
    return np.inf if labels is None else strain(candidates, labels)
