"""Why a graph is not planar, in words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

_SHOWN = 12  # edges that a sentence names


def obstruction_text(witness: Sequence[tuple[int, int]]) -> str:
    """What a subdivision of K5 or K3,3 joins, and by which edges.

    Parameters
    ----------
    witness : sequence of (int, int)
        Its edges.
    """
    ordered = sorted((min(pair), max(pair)) for pair in witness)
    shown = ", ".join(f"{a}-{b}" for a, b in ordered[:_SHOWN]) + (", ..." if len(ordered) > _SHOWN else "")
    edges = f"the edges {shown} (pairs of rows with an entry)"
    rows, degree = np.unique(np.array(witness), return_counts=True)
    corners = rows[degree > 2].tolist()
    if len(corners) == 5:
        return f"{edges} join each of the rows {_listed(corners)} to every other by a path (a subdivision of K5)"
    first = _first_side(witness, set(corners))
    second = _listed(row for row in corners if row not in first)
    return f"{edges} join each of the rows {_listed(first)} to each of {second} by a path (a subdivision of K3,3)"


def _first_side(witness: Sequence[tuple[int, int]], corners: set[int]) -> list[int]:
    """One side of a subdivision of K3,3: the corners to which no path leads from the first one."""
    neighbours: dict[int, list[int]] = {}
    for a, b in witness:
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    first = min(corners)
    other_side = set()
    for step in neighbours[first]:
        before, at = first, step
        while at not in corners:
            before, at = at, next(row for row in neighbours[at] if row != before)
        other_side.add(at)
    return sorted(corners - other_side)


def _listed(rows: Iterable[int]) -> str:
    *most, last = map(str, rows)
    return f"{', '.join(most)} and {last}"
