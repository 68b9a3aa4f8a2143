"""Readings of a small graph with a known c: every set of candidates of a drawing is held against its numbers.

Nearly all are found to be none without positions, from edge to edge.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...planar.piece import PieceMesh
from ..beginning import drawings
from ..candidates.candidates import Candidates
from ..reading import Reading

_MOST_STEPS = 300_000  # of the search for sets of cells, some seconds
_MOST_SETS = 20_000  # that are looked at
_MOST_SOLVED = 300
_AGREE = 1e-6  # of cotangents, relative


def enumerated(n: int, edges: NDArray, weights: NDArray, c: float) -> Iterator[Reading[Candidates]]:
    """Readings that fit, of sets of the candidates of the first drawing; none where there are too many sets.

    Parameters, with a known c, are those of :func:`unassemble.cells.search.read_cells`.
    """
    candidates = next(drawings(n, edges, weights, c, None), None)
    sets = None if candidates is None else _sets(candidates)
    if candidates is None or sets is None:
        return
    sides: list[list[int]] = [[] for _ in range(candidates.count)]
    for cell, half in candidates.sides.tolist():
        sides[cell].append(half >> 1)
    total = np.where(candidates.corner | candidates.half, np.pi / 2, np.pi).tolist()
    known: dict[bytes, PieceMesh | None] = {}
    solved = 0
    for chosen in sets:
        if _contradicts([(sides[cell], total[cell]) for cell in chosen], 2 * weights / c):
            continue
        if solved == _MOST_SOLVED:
            return
        solved += 1
        labels = np.zeros(candidates.count, dtype=bool)
        labels[chosen] = True
        reading = Reading.of(candidates, labels, known)
        if reading.fits:
            yield reading


def _sets(candidates: Candidates) -> list[list[int]] | None:
    """Sets of candidates that want different half-edges and leave no edge bare; None if there are too many."""
    cells = np.flatnonzero(~candidates.outer).tolist()
    wants = dict.fromkeys(cells, 0)
    for cell, half in candidates.sides.tolist():
        if cell in wants:
            wants[cell] |= 1 << half
    # When all that border an edge have been decided on, one of them has been chosen.
    due: list[list[int]] = [[] for _ in cells]
    for edge in np.flatnonzero(candidates.weights).tolist():
        both = 3 << 2 * edge
        bordering = [place for place, cell in enumerate(cells) if wants[cell] & both]
        if not bordering:
            return []
        due[bordering[-1]].append(both)
    found: list[list[int]] = []
    stack: list[tuple[int, int, list[int]]] = [(0, 0, [])]
    for _ in range(_MOST_STEPS):
        if not stack:
            return found
        place, taken, chosen = stack.pop()
        if place == len(cells):
            found.append(chosen)
            if len(found) > _MOST_SETS:
                return None
            continue
        cell = cells[place]
        choices = [(taken, chosen)]
        if not taken & wants[cell]:
            choices.append((taken | wants[cell], [*chosen, cell]))
        stack += [(place + 1, now, some) for now, some in choices if all(now & both for both in due[place])]
    return None


def _contradicts(cells: list[tuple[list[int], float]], cotangents: NDArray[np.float64]) -> bool:
    """Whether the angles of cells follow from each other until one is wrong.

    An edge with one open cell gives it what is left of its `cotangents` (e,), the sum of both sides; a cell with one
    open side sees it under what its other angles leave of pi, or of a right angle.
    """
    left = cotangents.tolist()
    size = max(map(abs, left))
    open_cells: list[list[int]] = [[] for _ in left]
    for cell, (sides, _) in enumerate(cells):
        for edge in sides:
            open_cells[edge].append(cell)
    open_sides = [set(sides) for sides, _ in cells]
    angle = [total for _, total in cells]
    waiting = list(range(len(left)))
    while waiting:
        edge = waiting.pop()
        if not open_cells[edge]:
            if abs(left[edge]) > _AGREE * size:
                return True
            continue
        if len(open_cells[edge]) > 1:
            continue
        cell = open_cells[edge].pop()
        # This side has what is left, and if only one other is open, so has that.
        angle[cell] -= float(np.arctan2(1.0, left[edge]))
        left[edge] = 0.0
        open_sides[cell].discard(edge)
        if angle[cell] <= 0:
            return True
        if len(open_sides[cell]) == 1:
            (last,) = open_sides[cell]
            open_sides[cell].clear()
            open_cells[last].remove(cell)
            left[last] -= 1 / float(np.tan(angle[cell]))
            waiting.append(last)
    return False
