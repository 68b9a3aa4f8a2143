"""Right angles at one vertex that might as well lie between other pairs of its edges.

Two right angles a-h-b and d-h-f with vanished far sides give h-a the cotangent |hb| / |ha|, in units of 2 c, and h-b
its inverse. Where d or f gets the same as b, the corners a-h-d and b-h-f, or a-h-f and b-h-d, give all four edges what
they have. Whether that makes another mesh depends on how the rest hangs together: the rest has the same entries, so
that what it holds without these corners stays where it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, islice

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..matrix import OperatorMatrix
from ..planar.piece import PieceMesh
from ..topology import Numbering, Polygons, components
from ..topology.keys import with_sides
from .cell_set import CellSet
from .corners import Alternative, Corners, OrientedMesh, cell
from .reading import FITS, Reading

_MOST_VERTICES = 400
_MOST_TRIALS = 60
_AS_WELL = 10.0  # times the misfit of the mesh that was found
_RIGHT = 1e-6  # cosine of an angle that may be a right one


def regrouped(
    stored: OperatorMatrix, mesh: OrientedMesh, corners: Corners, factors: NDArray, agree: float
) -> list[Alternative]:
    """For each component of the graph the first other mesh with two right angles regrouped, if there is one.

    Parameters are those of :func:`unassemble.cells.ambiguity.alternatives`, and

    corners : Corners
        All right angles of the mesh that was found.
    """
    return fitting(stored, mesh, factors, list(_regroupings(corners, mesh.z, agree)), first=True)


def fitting(
    stored: OperatorMatrix, mesh: OrientedMesh, factors: NDArray, others: list[Alternative], *, first: bool = False
) -> list[Alternative]:
    """Those about one vertex that fit, as their solution shows; of large graphs, those that the rest does not exclude.

    Parameters are those of :func:`unassemble.cells.ambiguity.alternatives`, and

    others : list of Alternative
    first : bool
        Only the first for each component.
    """
    if not others:
        return []
    parts = components(stored.n, stored.edges)
    label, number = np.full(stored.n, -1), np.zeros(stored.n, dtype=np.int64)
    for k, part in enumerate(parts):
        label[part.vertices], number[part.vertices] = k, np.arange(len(part.vertices))
    own: dict[int, list[Alternative]] = {}
    for other in others:
        own.setdefault(int(label[other.around[0]]), []).append(other)
    found = []
    for k, some in own.items():
        trials = _MOST_TRIALS if len(parts[k].vertices) <= _MOST_VERTICES else 0
        fits: list[Alternative] = []
        if trials:
            cells = mesh.chosen(label == k, number)
            weights, scale = -stored.entries[parts[k].edge_rows], float(factors[parts[k].vertices[0]])
            solved = _solved(parts[k], weights, scale, cells, number, some[:trials])
            fits = list(islice(solved, 1 if first else None))
        if not (first and fits) and len(some) > trials:
            untried = some[trials:]
            excluded = _excluded(stored.n, mesh, untried)
            fits += [replace(other, tested=False) for other, out in zip(untried, excluded, strict=True) if not out]
        found += fits[:1] if first else fits
    return found


def _solved(
    part: Numbering,
    weights: NDArray,
    scale: float,
    cells: OrientedMesh,
    number: NDArray[np.int64],
    others: list[Alternative],
) -> Iterator[Alternative]:
    """Those that fit as well as the mesh that was found; `cells` are its own, in the numbering of the part."""
    known: dict[bytes, PieceMesh | None] = {}

    def reading(polygons: Polygons, corner: NDArray[np.bool_]) -> Reading:
        some = CellSet(len(part.vertices), part.edges, weights, scale, polygons, corner)
        return Reading.of(some, np.ones(some.count, dtype=bool), known)

    none = Alternative((), (), (), (), ())
    as_found = reading(*_cells(cells, number, none)).misfit.max()
    for other in others:
        if reading(*_cells(cells, number, other)).misfit.max() <= max(FITS, _AS_WELL * as_found):
            yield other


def _regroupings(corners: Corners, z: NDArray, agree: float) -> Iterator[Alternative]:
    h, a, b = corners.apex, corners.first, corners.second
    gets = np.log(np.abs(z[b] - z[h]) / np.abs(z[a] - z[h]))  # of h-a; h-b has the opposite
    order = np.argsort(h, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(h[order])) + 1):
        for i, j in combinations(group.tolist(), 2):
            for d, f, other in ((a[j], b[j], gets[j]), (b[j], a[j], -gets[j])):
                apart = not {a[i], b[i]} & {d, f}  # with an edge in common they would come out as they are
                if apart and abs(gets[i] + other) <= agree:  # h-d has the inverse of h-a
                    old = (int(a[i]), int(b[i])), (int(a[j]), int(b[j]))
                    new = (int(a[i]), int(d)), (int(b[i]), int(f))
                    top = int(h[i])
                    gone, added = (tuple(sorted(cell(top, frozenset(pair)) for pair in two)) for two in (old, new))
                    yield Alternative((top,), (*old[0], *old[1]), (*new[0], *new[1]), gone, added)


def _cells(mesh: OrientedMesh, number: NDArray[np.int64], other: Alternative) -> tuple[Polygons, NDArray[np.bool_]]:
    """All cells of a mesh with the difference made, and which of them are its new corners."""
    gone = np.sort(number[np.array(other.cells, dtype=np.int64).reshape(-1, 3)], axis=1)
    kept = ~(np.sort(mesh.triangles, axis=1)[:, None, :] == gone).all(axis=2).any(axis=1)
    # The vertex of the right angle stands in the middle.
    added = [[a, h, b] for new in other.other_cells for h in other.around for a, b in [[v for v in new if v != h]]]
    three = np.concatenate([mesh.triangles[kept], number[np.array(added, dtype=np.int64).reshape(-1, 3)]])
    whole = Polygons.joined([Polygons(3 * np.arange(len(three) + 1), three.ravel()), mesh.polygons])
    place = np.arange(whole.count)
    return whole, (place >= len(three) - len(added)) & (place < len(three))


def _excluded(n: int, mesh: OrientedMesh, others: list[Alternative]) -> list[bool]:
    """Whether the rest of the mesh shows that each is none.

    If all rows of both corners belong to one piece without any of these corners, they are where they are, and the new
    corners have to have right angles there, and room.
    """
    triangles = np.concatenate([mesh.triangles, mesh.polygons.fans()[0]])
    corners = {old for other in others for old in other.cells}
    near = np.zeros(n, dtype=bool)
    near[[h for other in others for h in other.around]] = True
    gone = [k for k in np.flatnonzero(near[triangles].any(axis=1)) if tuple(sorted(triangles[k].tolist())) in corners]
    rest = np.delete(triangles, gone, axis=0)
    at: dict[int, list[int]] = {row: [] for corner in corners for row in corner}
    near[list(at)] = True
    for k in np.flatnonzero(near[rest].any(axis=1)).tolist():
        for row in rest[k].tolist():
            if row in at:
                at[row].append(k)
    surface = _edge_connected(n, rest).tolist()
    excluded = []
    for other in others:
        (h,) = other.around
        surfaces = [{surface[k] for k in at[row]} for old in other.cells for row in old]
        fixed = bool(set.intersection(*surfaces))
        excluded.append(fixed and not all(_has_room(mesh.z, h, new, rest[at[h]]) for new in other.other_cells))
    return excluded


def _edge_connected(n: int, triangles: NDArray[np.int64]) -> NDArray[np.int32]:
    """(m,) number of the piece of each triangle."""
    edges, _, opposite = with_sides(n, np.empty((0, 2), np.int64), triangles)
    m = len(triangles)
    owner = np.repeat(np.arange(m), 3)
    graph = sp.coo_array((np.ones(3 * m, np.int8), (owner, m + opposite.ravel())), shape=(m + len(edges),) * 2)
    return np.asarray(csgraph.connected_components(graph, directed=False)[1][:m])


def _has_room(z: NDArray[np.complex128], h: int, new: tuple[int, ...], around: NDArray[np.int64]) -> bool:
    """Whether a corner has a right angle at h as its vertices lie, and no triangle `around` h on its side of a leg."""
    a, b = (row for row in new if row != h)
    if abs((np.conj(z[a] - z[h]) * (z[b] - z[h])).real) > _RIGHT * abs(z[a] - z[h]) * abs(z[b] - z[h]):
        return False
    for leg, end in ((a, b), (b, a)):
        beside = around[(around == leg).any(axis=1)]
        third = beside.sum(axis=1) - h - leg
        if (
            (np.conj(z[leg] - z[h]) * (z[third] - z[h])).imag * (np.conj(z[leg] - z[h]) * (z[end] - z[h])).imag > 0
        ).any():
            return False
    return True
