"""Cells on half circles: their longest side, a diameter, faces right angles only and has vanished from the boundary.

A corner triangle is one with three vertices. Those with four show as paths of three edges along an empty face; a
path of any length may be one, but longer ones are not looked for.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..topology import Polygons
from ..topology.faces import joined
from .candidates import Candidates
from .reading import Reading


def with_half_circles(reading: Reading) -> Reading | None:
    """The same cells, unsolved, with half circles of four vertices among the candidates; None if there are none."""
    candidates = reading.candidates
    half = _paths(candidates)
    if not len(half):
        return None
    count, more = candidates.count, len(half)
    cells, none = candidates.cells, np.zeros(more, dtype=bool)
    tail, head = candidates.drawing.tail, candidates.drawing.head
    extended = replace(
        candidates,
        cells=Polygons(
            np.r_[cells.offsets, cells.offsets[-1] + 4 * np.arange(1, more + 1)],
            np.r_[cells.vertices, np.column_stack([tail[half], head[half[:, -1]]]).ravel()],
        ),
        sides=np.concatenate(
            [candidates.sides, np.column_stack([np.repeat(count + np.arange(more), 3), half.ravel()])]
        ),
        belief=np.r_[candidates.belief, np.zeros(more)],
        first=np.r_[candidates.first, none],
        outer=np.r_[candidates.outer, none],
        corner=np.r_[candidates.corner, none],
        strip=np.r_[candidates.strip, none],
    )
    return replace(reading, candidates=extended, labels=np.r_[reading.labels, none])


def _paths(candidates: Candidates) -> NDArray[np.int64]:
    """(k, 3) half-edges that follow each other along empty faces; no other edge joins their four vertices."""
    drawing = candidates.drawing
    empty = np.zeros(len(drawing.tail), dtype=bool)
    empty[candidates.sides[candidates.corner[candidates.sides[:, 0]], 1]] = True
    one = np.flatnonzero(empty)
    two = drawing.successor[one]
    three = drawing.successor[two]
    a, b, c, d = drawing.tail[one], drawing.head[one], drawing.head[two], drawing.head[three]
    chosen = empty[two] & empty[three] & (a != c) & (b != d) & (a != d)
    for p, q in ((a, c), (b, d), (a, d)):
        chosen &= ~joined(drawing.n_vertices, drawing.edges, p, q)
    return np.column_stack([one, two, three])[chosen]
