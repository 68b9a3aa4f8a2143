"""Small graphs read again with their vertices in another order.

Which reading of several that fit is found first depends on the order. This finds by trying what no rule foresees:
symmetric graphs whose cells and holes may change places, small pieces that hang together by vertices.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from ...matrix import OperatorMatrix
from ...topology import Numbering, components
from ...topology.keys import contains, pair_keys
from ..agreement import SAME_SCALE
from ..alike import ALIKE, Answers, Cells, Found, as_cell
from ..beginning import fitting_starts
from ..candidates.candidates import Candidates
from ..covers.covering import read_by_cover
from ..labels.descent import beside
from ..reading import NEARLY, Reading
from ..search import read_cells
from ..undivided import undivided
from .corners import Alternative, OrientedMesh, vanished_sides
from .cracks import cracked
from .enumeration import enumerated

MOST_VERTICES = 60
"""Rows of a component that is read again."""

LARGER = 400
"""Rows of one with vanished sides that is read again if no rule foresees anything."""

_MOST_NOISY = 400  # where errors of the entries may hide a difference; these are read once
_FEW = 25  # rows of a component all of whose readings are asked for
_ORDERS = 5
_ORDERS_OF_LARGER = 4
_MANY_ORDERS = 25  # of these, where sides have been supposed and c is not known

WORK = 3000
"""Rows times orders in which they are read again."""


def other_readings(
    stored: OperatorMatrix,
    mesh: OrientedMesh,
    factors: NDArray,
    scale: float | None,
    agree: float,
    *,
    least: int = 0,
    most: int = MOST_VERTICES,
    work: int = WORK,
) -> list[Alternative]:
    """Readings of components of more than `least` rows, up to `most`, that fit, but have other cells; one for each.

    They are read in up to five orders, very small ones in more, as long as their rows times orders are at most `work`,
    and in one at least; those that are alike count once. Other parameters are those of
    :func:`unassemble.cells.alternatives.ambiguity.alternatives`.
    """
    rng = np.random.default_rng(0)
    others = []
    noisy = _may_hide(stored, agree)
    if noisy:
        if least:
            return []  # all have been read at once
        most = _MOST_NOISY
    small = [part for part in components(stored.n, stored.edges) if least < len(part.vertices) <= most]
    n_orders = int(np.clip(work // max(distinct_vertices(stored, small), 1), 1, _MANY_ORDERS))
    half = with_vanished_sides(stored, mesh)
    answers = Answers()
    for part, own in zip(small, own_cells(stored.n, small, mesh), strict=True):
        supposed = bool(half[part.vertices].any())
        weights, c = -stored.entries[part.edge_rows], float(factors[part.vertices[0]])
        many = supposed and scale is None and len(part.vertices) <= _FEW
        orders = min(n_orders, _MANY_ORDERS if many else _ORDERS)
        if len(part.vertices) > MOST_VERTICES:
            orders = int(noisy) or (min(orders, _ORDERS_OF_LARGER) if supposed else 0)
        shuffled = (part.shuffled(rng) for _ in range(orders))
        ask = partial(_other_reading, shuffled, stored, own, scale, c, supposed=supposed, noisy=noisy)
        cells, factor, _ = answers.of(part, weights, own, ask)
        if cells is not None:
            same = abs(factor / c - 1) < max(SAME_SCALE, agree)
            others.append(Alternative.of(own, cells, same_scale=same))
    return others


def _may_hide(stored: OperatorMatrix, agree: float) -> bool:
    """Whether errors are known, and beyond those with which readings fit or do not."""
    return stored.errors is not None and agree > NEARLY


def hidden(stored: OperatorMatrix, mesh: OrientedMesh, agree: float) -> bool:
    """Whether errors may hide cells of components that are too large for that to be looked for.

    Those with triangles where anything has vanished: one more that has lost a side, or one elsewhere, may make no more
    difference than the errors.
    Other parameters are those of :func:`unassemble.cells.alternatives.ambiguity.alternatives`.
    """
    if not _may_hide(stored, agree):
        return False
    vanished, triangular = with_vanished_sides(stored, mesh), np.zeros(stored.n, dtype=bool)
    vanished[mesh.polygons.vertices] = True
    triangular[mesh.triangles] = True
    return any(
        bool(vanished[part.vertices].any() and triangular[part.vertices].any())
        for part in components(stored.n, stored.edges)
        if len(part.vertices) > _MOST_NOISY
    )


def distinct_vertices(stored: OperatorMatrix, parts: list[Numbering]) -> int:
    """How many vertices components have that are not alike, told by the numbers of their vertices and by their sums.

    What is found out about one holds for all that are alike: with fewer orders for each they would all share its luck.
    """
    size = np.array([len(part.vertices) for part in parts], dtype=np.int64)
    total = np.array([np.abs(stored.entries[part.edge_rows]).sum() for part in parts])
    order = np.lexsort((total, size))
    new = np.ones(len(parts), dtype=bool)
    new[1:] = (np.diff(size[order]) > 0) | (np.diff(total[order]) > ALIKE * total[order][1:])
    return int(size[order][new].sum())


def with_vanished_sides(stored: OperatorMatrix, mesh: OrientedMesh) -> NDArray[np.bool_]:
    """(n,) rows of triangles with a side that has no entry; inside it would make a polygon of two."""
    rows = np.zeros(stored.n, dtype=bool)
    side, facing = vanished_sides(stored.n, stored.edges, mesh)
    rows[mesh.boundary[side]] = rows[facing] = True
    return rows


def _other_reading(
    orders: Iterable[Numbering],
    stored: OperatorMatrix,
    own: Cells,
    scale: float | None,
    c: float,
    *,
    supposed: bool,
    noisy: bool,
) -> Found:
    """Other cells that fit in some order of the vertices, and their c.

    Among all starts if vanished sides have been `supposed` in these cells, as they are not where something fits without
    them; else, or where no start fits, by the search. Once also what differs little from what is found, where that may
    make little difference; and in very small components all sets of candidates.
    """
    for number, part in enumerate(orders):
        errors = None if stored.errors is None else stored.errors[part.edge_rows]
        graph = len(part.vertices), part.edges, -stored.entries[part.edge_rows], scale, errors
        found = list(fitting_starts(*graph)) if supposed else []
        if not found and (reading := read_cells(*graph, quick=True)) is not None and reading.fits:
            found = [reading]
        near = [beside(one) for one in found if isinstance(one.candidates, Candidates) and (supposed or noisy)]
        few = supposed and not noisy and len(part.vertices) <= _FEW
        every = enumerated(*graph[:3], c) if few else iter(())
        for reading in chain(found, *(*near, every) if number == 0 else ()):
            if (cells := cells_of(reading, part)) != own and not cracked(reading):
                return cells, next(solved.scale for solved in reading.meshes if solved), False
    return None, c, False


def own_cells(n: int, parts: list[Numbering], mesh: OrientedMesh) -> list[set[tuple[int, ...]]]:
    """The cells of each part of the graph."""
    label = np.full(n, -1)
    for k, part in enumerate(parts):
        label[part.vertices] = k
    triangles = mesh.triangles[label[mesh.triangles[:, 0]] >= 0]
    first = mesh.polygons.vertices[mesh.polygons.offsets[:-1]]
    polygons = mesh.polygons.chosen(label[first] >= 0, np.arange(n))
    own: list[set[tuple[int, ...]]] = [set() for _ in parts]
    for cell in (*map(as_cell, triangles.tolist()), *_polygons(polygons.offsets, polygons.vertices)):
        own[label[cell[0]]].add(cell)
    return own


def with_another_scale(
    part: Numbering,
    weights: NDArray,
    errors: NDArray | None,
    c: float,
    others: list[float],
    *,
    searched: bool = True,
) -> Reading | None:
    """A reading that fits with the first of some factors that allows one, c left out; by a cover or a search."""
    for other in others:
        if abs(other / c - 1) > SAME_SCALE:
            graph = len(part.vertices), part.edges, weights, other, errors
            reading = read_cells(*graph) if searched else read_by_cover(*graph)
            if reading is not None and reading.fits:
                return reading
    return None


def cells_of(reading: Reading, numbering: Numbering) -> set[tuple[int, ...]]:
    """However they were put together."""
    n = reading.candidates.n_vertices
    vanished = ~contains(pair_keys(n, *reading.candidates.edges.T), pair_keys(n, *reading.edges.T))
    triangles, polygons = undivided(reading.pieces, vanished)
    cells = _polygons(polygons.offsets, numbering.vertices[polygons.vertices])
    return cells | set(map(as_cell, numbering.vertices[triangles].tolist()))


def _polygons(offsets: NDArray, vertices: NDArray) -> set[tuple[int, ...]]:
    return {as_cell(cell.tolist()) for cell in np.split(vertices, offsets[1:-1]) if len(cell)}
