"""Right angles at one vertex that might as well lie between other pairs of its edges.

Two right angles a-h-b and d-h-f (:mod:`unassemble.cells.alternatives.right_angles`) give h-a the cotangent |hb| /
|ha|, in units of 2 c, and h-b its inverse. Where d or f gets the same as b, the corners a-h-d and b-h-f, or a-h-f and
b-h-d, give all four edges what they have. Two rectangles of one shape that touch in a vertex, say, are their outer
halves and two right triangles in the gaps between them as well. Whether that makes another mesh depends on how the
rest hangs together: it has the same entries, so that what it holds without these right angles stays where it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain, islice

import numpy as np
from numpy.typing import NDArray

from ...matrix import OperatorMatrix
from ...planar.piece import PieceMesh
from ...topology import Numbering, Polygons, components
from ...topology.pieces import edge_connected
from ..alike import as_cell
from ..candidates.cell_set import CellSet
from ..reading import FITS, Reading
from .corners import Alternative, Corners, OrientedMesh, cell
from .exhaustion import Budget, TooManyError
from .right_angles import RightAngle, right_angles

_MOST_VERTICES = 400
_MOST_TRIALS = 60
_AT_ONCE = 1000  # of which it is asked together whether the rest excludes them
_LISTED, _SLOW = 0.1, 50  # solutions that listing one costs, and rows of a component that cost as much as one more
_AS_WELL = 10.0  # times the misfit of the mesh that was found
_RIGHT = 1e-6  # cosine of an angle that may be a right one, without noise


def regrouped(
    stored: OperatorMatrix, mesh: OrientedMesh, corners: Corners, factors: NDArray, agree: float
) -> list[Alternative]:
    """For each component of the graph the first other mesh with two right angles regrouped, if there is one.

    Parameters are those of :func:`unassemble.cells.alternatives.ambiguity.alternatives`, and

    corners : Corners
        All corners of the mesh that was found.
    """
    groups = right_angles(stored.n, stored.edges, mesh, corners, agree)
    return fitting(stored, mesh, factors, _regroupings(groups, agree), agree, first=True)


def fitting(
    stored: OperatorMatrix,
    mesh: OrientedMesh,
    factors: NDArray,
    others: Iterable[Alternative],
    agree: float,
    *,
    first: bool = False,
) -> list[Alternative]:
    """Those about one vertex that fit, as their solution shows; of large graphs, those that the rest does not exclude.

    Where there are too many, one that was not tried stands for the others.

    Parameters are those of :func:`unassemble.cells.alternatives.ambiguity.alternatives`, and

    others : iterable of Alternative
    first : bool
        Only the first for each component.
    """
    others = iter(others)
    some = list(islice(others, _AT_ONCE))
    if not some:
        return []
    parts = components(stored.n, stored.edges)
    label, number = np.full(stored.n, -1), np.zeros(stored.n, dtype=np.int64)
    for k, part in enumerate(parts):
        label[part.vertices], number[part.vertices] = k, np.arange(len(part.vertices))
    left = {k: _MOST_TRIALS if len(part.vertices) <= _MOST_VERTICES else 0 for k, part in enumerate(parts)}
    found: dict[int, list[Alternative]] = {}
    budget = Budget()
    while some and not (first and len(found) == len(parts)):
        own: dict[int, list[Alternative]] = {}
        for other in some:
            own.setdefault(int(label[other.around[0]]), []).append(other)
        for k, mine in own.items():
            if first and k in found:
                continue
            trials, left[k] = left[k], max(left[k] - len(mine), 0)
            fits: list[Alternative] = []
            try:
                budget.spend(_LISTED * len(mine))
                if trials:
                    cells = mesh.chosen(label == k, number)
                    weights, scale = -stored.entries[parts[k].edge_rows], float(factors[parts[k].vertices[0]])
                    solved = _solved(parts[k], weights, scale, cells, number, mine[:trials], budget)
                    fits = list(islice(solved, 1 if first else None))
            except TooManyError:
                return [*chain(*found.values()), replace(mine[0], tested=False)]
            if not (first and fits) and len(mine) > trials:
                untried = mine[trials:]
                excluded = _excluded(stored.n, mesh, untried, max(_RIGHT, agree))
                fits += [replace(other, tested=False) for other, out in zip(untried, excluded, strict=True) if not out]
            if fits:
                found.setdefault(k, []).extend(fits[:1] if first else fits)
        some = list(islice(others, _AT_ONCE))
    return list(chain(*found.values()))


def _solved(
    part: Numbering,
    weights: NDArray,
    scale: float,
    cells: OrientedMesh,
    number: NDArray[np.int64],
    others: list[Alternative],
    budget: Budget,
) -> Iterator[Alternative]:
    """Those that fit as well as the mesh that was found; `cells` are its own, in the numbering of the part."""
    known: dict[bytes, PieceMesh | None] = {}

    def reading(polygons: Polygons, corner: NDArray[np.bool_]) -> Reading:
        some = CellSet(len(part.vertices), part.edges, weights, scale, polygons, corner)
        return Reading.of(some, np.ones(some.count, dtype=bool), known)

    none = Alternative((), (), (), (), ())
    as_found = reading(*_cells(cells, number, none)).misfit.max()
    for other in others:
        budget.spend(1 + len(part.vertices) / _SLOW)
        if reading(*_cells(cells, number, other)).misfit.max() <= max(FITS, _AS_WELL * as_found):
            yield other


def _regroupings(groups: list[list[RightAngle]], agree: float) -> Iterator[Alternative]:
    """One after the other: there are about as many as pairs of right angles at a vertex where all cells are alike."""
    for group in groups:
        order = sorted(group, key=lambda one: abs(one.gets))
        for k, one in enumerate(order):
            for two in order[k + 1 :]:
                if abs(two.gets) - abs(one.gets) > agree:
                    break
                yield from _of_pair(one, two, agree)


def _of_pair(one: RightAngle, two: RightAngle, agree: float) -> Iterator[Alternative]:
    a, b, h = one.first, one.second, one.apex
    for d, f, gets in ((two.first, two.second, two.gets), (two.second, two.first, -two.gets)):
        apart = not {a, b} & {d, f}  # with an edge in common they would come out as they are
        if apart and one.cell != two.cell and abs(one.gets + gets) <= agree:  # h-d has the inverse of h-a
            new = cell(h, frozenset((a, d))), cell(h, frozenset((b, f)))
            added = (*new, *one.rest, *two.rest)
            yield Alternative((h,), (a, b, d, f), (a, d, b, f), (one.cell, two.cell), added)


def _cells(mesh: OrientedMesh, number: NDArray[np.int64], other: Alternative) -> tuple[Polygons, NDArray[np.bool_]]:
    """All cells of a mesh with the difference made, and which of them are its new corners."""
    gone = {as_cell(number[list(old)].tolist()) for old in other.cells}
    outlines = np.split(mesh.polygons.vertices, mesh.polygons.offsets[1:-1]) if mesh.polygons.count else []
    own = mesh.triangles.tolist() + [outline.tolist() for outline in outlines]
    cells = [old for old in own if as_cell(old) not in gone]
    for row in other.around:
        h = int(number[row])
        for old in own:
            if len(old) > 3 and as_cell(old) in gone:
                k = old.index(h)
                cells.append(old[k + 1 :] + old[:k])
        # The vertex of the right angle stands in the middle.
        ends = [[int(number[v]) for v in new if v != row] for new in other.other_cells if row in new]
        cells += [[a, h, b] for a, b in ends]
    new_corners = sum(row in new for row in other.around for new in other.other_cells)
    return Polygons.of(cells), np.arange(len(cells)) >= len(cells) - new_corners


def _excluded(n: int, mesh: OrientedMesh, others: list[Alternative], error: float) -> list[bool]:
    """Whether the rest of the mesh shows that each is none.

    If all rows of both corners belong to one piece without any of these cells, they are where they are, and the new
    corners have to have right angles there, and room.
    """
    gone = {old for other in others for old in other.cells}
    at: dict[int, list[int]] = {row: [] for other in others for row in (*other.around, *other.found)}
    near = np.zeros(n, dtype=bool)
    near[list(at)] = True
    touched = np.flatnonzero(near[mesh.triangles].any(axis=1))
    kept = np.delete(mesh.triangles, [k for k in touched if as_cell(mesh.triangles[k].tolist()) in gone], axis=0)
    fans, _ = mesh.polygons.fans()
    owner = np.repeat(np.arange(mesh.polygons.count), mesh.polygons.size - 2)
    touched = np.unique(np.repeat(np.arange(mesh.polygons.count), mesh.polygons.size)[near[mesh.polygons.vertices]])
    outlines = [mesh.polygons.vertices[mesh.polygons.offsets[k] : mesh.polygons.offsets[k + 1]] for k in touched]
    cut = [k for k, outline in zip(touched, outlines, strict=True) if as_cell(outline.tolist()) in gone]
    rest = np.concatenate([kept, fans[~np.isin(owner, cut)]])
    for k in np.flatnonzero(near[rest].any(axis=1)).tolist():
        for row in rest[k].tolist():
            if row in at:
                at[row].append(k)
    surface = edge_connected(n, rest).tolist()
    excluded = []
    for other in others:
        (h,) = other.around
        surfaces = [{surface[k] for k in at[row]} for row in (h, *other.found)]
        fixed = bool(set.intersection(*surfaces))
        corners = [new for new in other.other_cells if h in new]
        excluded.append(fixed and not all(_has_room(mesh.z, h, new, rest[at[h]], error) for new in corners))
    return excluded


def _has_room(z: NDArray[np.complex128], h: int, new: tuple[int, ...], around: NDArray[np.int64], error: float) -> bool:
    """Whether a corner has a right angle at h as its vertices lie, and no triangle `around` h on its side of a leg."""
    a, b = (row for row in new if row != h)
    if abs((np.conj(z[a] - z[h]) * (z[b] - z[h])).real) > error * abs(z[a] - z[h]) * abs(z[b] - z[h]):
        return False
    for leg, end in ((a, b), (b, a)):
        beside = around[(around == leg).any(axis=1)]
        third = beside.sum(axis=1) - h - leg
        if (
            (np.conj(z[leg] - z[h]) * (z[third] - z[h])).imag * (np.conj(z[leg] - z[h]) * (z[end] - z[h])).imag > 0
        ).any():
            return False
    return True
