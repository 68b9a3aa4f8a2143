"""Components of the graph that are alike, numbers and all: what has been found out about one holds for the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..topology import Numbering
from ..topology.canonical import LARGEST, settled_numbering

_DIGITS = 9  # of the weights, to which those of components that are alike agree

ALIKE = 10.0**-_DIGITS
"""Relative difference of what is the same in components that are alike."""

Cells = set[tuple[int, ...]]
"""Cells as :func:`as_cell` writes them."""

Found = tuple[Cells | None, float, bool]
"""Cells of a component, by rows; their c; and whether the search was left open."""


def as_cell(corners: Sequence[int]) -> tuple[int, ...]:
    """A cell by its corners in running order: the smallest first, then the smaller of its neighbours."""
    place = min(range(len(corners)), key=corners.__getitem__)
    cell = (*corners[place:], *corners[:place])
    return cell if cell[1] < cell[-1] else (cell[0], *cell[:0:-1])


class Answers:
    """Other cells of components, found once for all that are alike and have been read alike."""

    def __init__(self) -> None:
        self._known: dict[bytes, list[tuple[NDArray[np.int64], Cells, Found]]] = {}

    def of(self, part: Numbering, weights: NDArray, own: Cells, ask: Callable[[], Found]) -> Found:
        """What is known of a component, or what `ask` finds out.

        Parameters
        ----------
        part : Numbering
        weights : (e,) float64
            -A_ij of its edges.
        own : set of tuple of int
            The cells that it was read with.
        ask : callable
        """
        if len(part.vertices) > LARGEST:
            return ask()
        size = float(np.abs(weights).max())
        rounded = np.round(weights / size, _DIGITS)
        inner = settled_numbering(len(part.vertices), part.edges, rounded)
        name = b"".join([f"{size:.{_DIGITS}e}".encode(), inner.edges.tobytes(), rounded[inner.edge_rows].tobytes()])
        rows = part.vertices[inner.vertices]
        alike = self._known.setdefault(name, [])
        for former, former_own, (cells, c, left_open) in alike:
            now = dict(zip(former.tolist(), rows.tolist(), strict=True))
            if _renamed(former_own, now) == own:
                return None if cells is None else _renamed(cells, now), c, left_open
        found = ask()
        alike.append((rows, own, found))
        return found


def _renamed(cells: Cells, number: dict[int, int]) -> Cells:
    return {as_cell([number[row] for row in cell]) for cell in cells}
