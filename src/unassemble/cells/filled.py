"""Triangles that may be holes of three edges: a mesh without inner vertices fits with one of them filled, as well.

Where a piece has no more entries than coordinates and c, every choice of its triangles fits, with a c of its own. A
triangle whose sides are all inner may be a hole; then the others fit too, by themselves, only if it is one. Each is
tried alone; where several are holes, lone triangles agree in another c, with which the whole is read again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..topology import Numbering, Piece, Polygons, Topology, components
from ..topology.cycles import three_cycles
from .cell_set import CellSet
from .corners import Alternative
from .covering import MOST_VERTICES
from .peeling import scales_of_lone_triangles
from .reading import Reading
from .rereading import cells_of, with_another_scale

_MOST_TRIALS = 60


def filled_holes(stored: OperatorMatrix, topology: Topology, factors: NDArray) -> list[Alternative]:
    """Triangles of loose pieces without which the matrix is given back, too; c is not known.

    Of components that are too large, and where there are too many triangles to try, one that is not tried stands for
    all of them.

    Parameters
    ----------
    stored : OperatorMatrix
    topology : Topology
        Of the mesh that was found.
    factors : (n,) float64
        c of the piece of each row.
    """
    if not any(_suspects(topology.pieces)):
        return []
    found = []
    for part in components(stored.n, stored.edges):
        own = np.zeros(stored.n, dtype=bool)
        own[part.vertices] = True
        pieces = [piece for piece in topology.pieces if own[piece.vertices[0]]]
        suspects = list(_suspects(pieces))
        if not suspects:
            continue
        if len(part.vertices) > MOST_VERTICES:
            found.append(_without(suspects[:1], tested=False))
            continue
        triangles = np.concatenate([piece.vertices[piece.triangles] for piece in pieces])
        holes = _holes(part, -stored.entries[part.edge_rows], triangles, suspects, factors[part.vertices[0]])
        if holes:
            found.append(_without(holes))
        elif len(suspects) > _MOST_TRIALS:
            found.append(_without(suspects[_MOST_TRIALS:][:1], tested=False))
    return found


def _without(triangles: list[tuple[int, ...]], *, tested: bool = True) -> Alternative:
    return Alternative((), (), (), tuple(triangles), (), same_scale=False, tested=tested)


def _holes(
    part: Numbering, weights: NDArray, triangles: NDArray, suspects: list[tuple[int, ...]], c: float
) -> list[tuple[int, ...]]:
    """Triangles of a component that may be holes together; none if all must be cells."""
    n = len(part.vertices)
    local = np.zeros(int(part.vertices.max()) + 1, dtype=np.int64)
    local[part.vertices] = np.arange(n)
    for triangle in suspects[:_MOST_TRIALS]:
        rest = triangles[(np.sort(triangles, axis=1) != triangle).any(axis=1)]
        cells = Polygons(np.arange(0, 3 * len(rest) + 1, 3), local[rest].ravel())
        some = CellSet(n, part.edges, weights, None, cells, np.zeros(len(rest), dtype=bool))
        if Reading.of(some, np.ones(len(rest), dtype=bool)).fits:
            return [triangle]
    _, opposite = three_cycles(n, part.edges)
    reading = with_another_scale(part, weights, c, scales_of_lone_triangles(opposite, weights))
    if reading is None:
        return []
    kept = cells_of(reading, part)
    return [triangle for triangle in suspects if triangle not in kept] or suspects[:1]


def _suspects(pieces: Sequence[Piece]) -> Iterator[tuple[int, ...]]:
    """Triangles of loose pieces with three inner sides."""
    for piece in pieces:
        if len(piece.edges) <= 2 * piece.n_vertices - 3:
            inner = np.asarray((piece.facing[:, 1] >= 0)[piece.opposite].all(axis=1))
            for triangle in np.sort(piece.vertices[piece.triangles[inner]], axis=1).tolist():
                yield tuple(triangle)
