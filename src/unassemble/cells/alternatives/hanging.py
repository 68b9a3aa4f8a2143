"""Small parts that hang on a mesh by single vertices, read again by themselves.

Where a vertex h holds the graph together, cells on both sides of it have no more in common than right angles at h whose
far sides have vanished. The cells of the part beyond it, these among them, make a matrix of their own; what has the
same matrix with the same c may stand in their place, however large the rest is. A chain of right triangles, say, may be
another one, of more triangles or fewer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ...matrix import OperatorMatrix
from ...matrix.operator import row_sizes
from ...planar.cotangent import cotangent
from ...topology import Numbering, Polygons, components
from ...topology.adjacency import adjacency
from ...topology.blocks import blocks
from ...topology.keys import contains, distinct, pair_keys, with_sides
from ..alike import as_cell
from ..candidates.cell_set import CellSet
from ..reading import Reading
from .corners import Alternative, OrientedMesh
from .cracks import cracked
from .exhaustion import lies_flat
from .rereading import MOST_VERTICES, WORK, distinct_vertices, other_readings, with_vanished_sides

_STRETCH = 12  # edges
_MOST_WITH_LEGS = 2 * MOST_VERTICES  # legs of right angles in the rest count as rows
_WORK = WORK // 30
_MOST_TRIED = 60  # other readings of parts, in each component, with which the rest is solved
_VANISHED = 1e-9  # of what the cells of a part leave to sides that they share with others, relative to the row


def other_hanging_parts(
    stored: OperatorMatrix, mesh: OrientedMesh, factors: NDArray, agree: float
) -> tuple[list[Alternative], bool]:
    """Another reading of a small part of each larger component that has one which fits with the rest as it is.

    Parameters and results are those of :func:`unassemble.cells.alternatives.ambiguity.alternatives`.
    """
    half = with_vanished_sides(stored, mesh)
    if not half.any():
        return [], False
    large = [
        part
        for part in components(stored.n, stored.edges)
        if len(part.vertices) > MOST_VERTICES and half[part.vertices].any()
    ]
    found: list[Alternative] = []
    left_open = False
    for labels in zip(*(_also_wider(part.edges, small_parts(part)) for part in large), strict=True):
        label, so_far = np.full(len(stored.edges), -1), 0
        for part, own in zip(large, labels, strict=True):
            label[part.edge_rows] = np.where(own >= 0, own + so_far, -1)
            so_far += int(own.max()) + 1
        label[~np.isin(label, label[half[stored.edges].all(axis=1)])] = -1
        if (label < 0).all():
            continue
        apart = _Apart.of(stored, mesh, factors, label)
        if distinct_vertices(apart.matrix, components(apart.matrix.n, apart.matrix.edges)) > WORK:
            left_open = True
            break
        c = np.ones(apart.matrix.n)
        others = other_readings(apart.matrix, apart.mesh, c, 1.0, agree, most=_MOST_WITH_LEGS, work=_WORK)
        found += [other.renumbered(apart.rows) for other in others]
    fitting: list[Alternative] = []
    for part in large:
        inside = np.zeros(stored.n, dtype=bool)
        inside[part.vertices] = True
        own = [other for other in found if inside[(*other.cells, *other.other_cells)[0][0]]]
        tried = (_with_the_rest(stored, mesh, factors, other, part) for other in own[:_MOST_TRIED])
        fits = next((other for other in tried if other), None)
        left_open |= fits is None and len(own) > _MOST_TRIED
        fitting += [] if fits is None else [fits]
    return fitting, left_open


def small_parts(part: Numbering) -> NDArray[np.int64]:
    """(2, e) labels of parts that hang together by small blocks, -1 for all else.

    Where they are too large as well they are cut into stretches, in two ways, at different distances from a vertex;
    what is too large even so is left out.
    """
    n, edges = len(part.vertices), part.edges
    block = np.unique(blocks(n, edges), return_inverse=True)[1]
    size = np.bincount(distinct(np.concatenate([block * n + edges[:, 0], block * n + edges[:, 1]])) // n)
    small = np.flatnonzero(size[block] <= MOST_VERTICES)
    labels, number = np.full((2, len(edges)), -1), count()
    for own in components(n, edges[small]):
        if len(own.vertices) <= MOST_VERTICES:
            labels[0, small[own.edge_rows]] = next(number)
            continue
        for label, begin in zip(labels, (0, _STRETCH // 2), strict=True):
            for rows in _stretches(own, block[small[own.edge_rows]], begin):
                label[small[own.edge_rows[rows]]] = next(number)
    return labels


def _also_wider(edges: NDArray[np.int64], labels: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Labels of parts, and of the same with all edges at their vertices: what differs may lie across such a vertex."""
    wider = []
    for label in labels:
        at_vertex = np.full(int(edges.max()) + 1, -1)
        at_vertex[edges[label >= 0]] = label[label >= 0, None]
        wider.append(np.where(label >= 0, label, at_vertex[edges].max(axis=1)))
    return [*labels, *wider]


def _stretches(part: Numbering, block: NDArray[np.int64], begin: int) -> Iterator[NDArray[np.int64]]:
    """Edges of whole blocks, `block` (e,), that hang together, all about as far from a vertex."""
    n, edges = len(part.vertices), part.edges
    distance = csgraph.shortest_path(adjacency(n, edges), unweighted=True, indices=0).astype(np.int64)
    stretch = (distance[edges] + begin) // _STRETCH
    block = np.unique(block, return_inverse=True)[1]
    first, last = np.full(block.max() + 1, n), np.zeros(block.max() + 1, dtype=np.int64)
    np.minimum.at(first, block, stretch.min(axis=1))
    np.maximum.at(last, block, stretch.max(axis=1))
    rows = np.flatnonzero((first == last)[block])
    # A vertex between two stretches is one in each.
    copy = first[block[rows], None] * n + edges[rows]
    copies = distinct(copy)
    for own in components(len(copies), np.searchsorted(copies, copy)):
        if len(own.vertices) <= MOST_VERTICES:
            yield rows[own.edge_rows]


@dataclass(frozen=True, eq=False)
class _Apart:
    """Parts of a mesh as components of a matrix of their own, with c = 1.

    Attributes
    ----------
    matrix : OperatorMatrix
    mesh : OrientedMesh
        Its boundary in any order, as if it were one loop.
    rows : (n,) int64
        The row of the whole matrix behind each of its rows.
    """

    matrix: OperatorMatrix
    mesh: OrientedMesh
    rows: NDArray[np.int64]

    @classmethod
    def of(cls, stored: OperatorMatrix, mesh: OrientedMesh, factors: NDArray, label: NDArray) -> _Apart:
        """The cells with a side in each of some parts; `label` (e,) says in which an edge lies, if in any."""
        n, cells, near = stored.n, _all_cells(mesh), np.zeros(stored.n, dtype=bool)
        near[stored.edges[label >= 0]] = True
        owner = np.repeat(np.arange(cells.count), cells.size)
        cells = cells.chosen(np.bincount(owner[near[cells.vertices]], minlength=cells.count) >= 2, np.arange(n))
        fans, _ = cells.fans()
        sides, given, opposite = with_sides(n, stored.edges, fans)
        at_side = np.full(len(sides), -1)
        at_side[given] = label
        part = np.full(cells.count, -1)
        np.maximum.at(part, np.repeat(np.arange(cells.count), cells.size - 2), at_side[opposite].max(axis=1))

        # A vertex of several parts has a row in each.
        own = cells.chosen(part >= 0, np.arange(n))
        copy = np.repeat(part[part >= 0], own.size) * n + own.vertices
        copies = distinct(copy)
        rows = copies % n
        own = Polygons(own.offsets, np.searchsorted(copies, copy))
        triangular = own.size == 3
        itself = np.arange(len(rows))
        triangles = own.chosen(triangular, itself).vertices.reshape(-1, 3)
        polygons = own.chosen(~triangular, itself)
        boundary = _boundary(own)
        oriented = OrientedMesh(triangles, polygons, boundary, np.array([0, len(boundary)]), mesh.z[rows])
        return cls(_assembled(stored, oriented, rows, factors), oriented, rows)


def _assembled(stored: OperatorMatrix, mesh: OrientedMesh, rows: NDArray, factors: NDArray) -> OperatorMatrix:
    """The matrix of a mesh of parts, in units of c; of the sides only those that have entries in the whole matrix."""
    n = len(rows)
    fans, _ = _all_cells(mesh).fans()
    edges, _, opposite = with_sides(n, np.empty((0, 2), dtype=np.int64), fans)
    at = mesh.z[fans]
    weights = np.bincount(opposite.ravel(), cotangent(at[:, [1, 2, 0]] - at, at[:, [2, 0, 1]] - at).ravel() / 2)
    keys, wanted = pair_keys(stored.n, *stored.edges.T), pair_keys(stored.n, *rows[edges].T)
    least = _VANISHED * row_sizes(n, edges, np.abs(weights))[edges].min(axis=1)
    small = np.abs(weights) <= least
    weights[small] = 0.0
    # Between two cells of a part nothing is missing: what vanishes there and has an entry is a zero that was stored.
    kept = contains(keys, wanted) & ~(small & (np.bincount(opposite.ravel()) < 2))
    edges = edges[kept]
    errors = None
    if stored.errors is not None:
        errors = stored.errors[np.searchsorted(keys, wanted[kept])] / np.abs(factors[rows[edges[:, 0]]])
    return OperatorMatrix(n, edges, -weights[kept], np.zeros(n), errors=errors)


def _boundary(cells: Polygons) -> NDArray[np.int64]:
    """(b, 2) directed sides that no other cell has."""
    tail, head = cells.vertices, cells.following
    n = int(tail.max(initial=0)) + 1
    single = ~contains(np.sort(tail * n + head), head * n + tail)
    return np.column_stack([tail[single], head[single]])


def _all_cells(mesh: OrientedMesh) -> Polygons:
    return Polygons.joined([Polygons.of_triangles(mesh.triangles), mesh.polygons])


def _with_the_rest(
    stored: OperatorMatrix, mesh: OrientedMesh, factors: NDArray, other: Alternative, part: Numbering
) -> Alternative | None:
    """Another reading somewhere in this component if it fits with the rest."""
    number = np.full(stored.n, -1)
    number[part.vertices] = np.arange(len(part.vertices))
    cells = _all_cells(mesh.chosen(number >= 0, number))
    inside = other.renumbered(number)
    owner = np.repeat(np.arange(cells.count), cells.size)
    touched = np.isin(cells.vertices, [v for old in inside.cells for v in old])
    kept = np.ones(cells.count, dtype=bool)
    for k in np.flatnonzero(np.bincount(owner[touched], minlength=cells.count) == cells.size).tolist():
        kept[k] = as_cell(cells.vertices[cells.offsets[k] : cells.offsets[k + 1]].tolist()) not in inside.cells
    every = Polygons.joined([cells.chosen(kept, np.arange(len(part.vertices))), Polygons.of(inside.other_cells)])
    weights, errors = -stored.entries[part.edge_rows], None if stored.errors is None else stored.errors[part.edge_rows]
    none = np.zeros(every.count, dtype=bool)
    c = float(factors[part.vertices[0]])
    candidates = CellSet(len(part.vertices), part.edges, weights, c, every, none, errors=errors)
    reading = Reading.of(candidates, ~none)
    return other if reading.fits and lies_flat(reading) and not cracked(reading) else None
