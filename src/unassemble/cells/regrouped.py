"""Right angles at one vertex that might as well lie between other pairs of its edges.

Two right angles a-h-b and d-h-f with vanished far sides give h-a the cotangent |hb| / |ha|, in units of 2 c, and h-b
its inverse. Where d or f gets the same as b, the corners a-h-d and b-h-f, or a-h-f and b-h-d, give all four edges what
they have. Whether that makes another mesh depends on how the rest hangs together, and is found out by trying.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..planar.piece import PieceMesh
from ..topology import Numbering, Polygons, components
from .cell_set import CellSet
from .corners import Alternative, Corners, OrientedMesh, cell
from .reading import Reading

_MOST_VERTICES = 400
_MOST_TRIALS = 60


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
    """Those about one vertex that fit, as their solution shows; in large graphs none is solved, and all are kept.

    Parameters are those of :func:`unassemble.cells.ambiguity.alternatives`, and

    others : list of Alternative
    first : bool
        Only the first for each component; in large graphs none.
    """
    if not others:
        return []
    found = []
    for part in components(stored.n, stored.edges):
        rows = np.zeros(stored.n, dtype=bool)
        rows[part.vertices] = True
        own = [other for other in others if rows[other.around[0]]]
        if len(part.vertices) > _MOST_VERTICES:
            found += [] if first else own
            continue
        known: dict[bytes, PieceMesh | None] = {}
        weights, scale = -stored.entries[part.edge_rows], float(factors[part.vertices[0]])
        for other in own[:_MOST_TRIALS]:
            cells = _cells(stored.n, mesh, part, other)
            some = CellSet(len(part.vertices), part.edges, weights, scale, *cells)
            if Reading.of(some, np.ones(some.count, dtype=bool), known).fits:
                found.append(other)
                if first:
                    break
    return found


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


def _cells(n: int, mesh: OrientedMesh, part: Numbering, other: Alternative) -> tuple[Polygons, NDArray[np.bool_]]:
    """All cells of a part of the graph with the difference made, and which of them are its new corners."""
    number = np.full(n, -1)
    number[part.vertices] = np.arange(len(part.vertices))
    triangles = mesh.triangles[number[mesh.triangles[:, 0]] >= 0]
    gone = (np.sort(triangles, axis=1)[:, None, :] == np.array(other.cells)).all(axis=2).any(axis=1)
    # The vertex of the right angle stands in the middle.
    (h,) = other.around
    ends = [[v for v in new if v != h] for new in other.other_cells]
    added = np.array([[a, h, b] for a, b in ends])
    three = np.concatenate([triangles[~gone], added])
    first = mesh.polygons.vertices[mesh.polygons.offsets[:-1]]
    own = mesh.polygons.chosen(number[first] >= 0, number)
    whole = Polygons.joined([Polygons(3 * np.arange(len(three) + 1), number[three].ravel()), own])
    place = np.arange(whole.count)
    return whole, (place >= len(three) - len(added)) & (place < len(three))
