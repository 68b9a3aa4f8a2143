"""Triangles that may be holes of three edges: a mesh without inner vertices fits with one of them filled, as well.

Where a piece has no more entries than coordinates and c, every choice of its triangles fits, with a c of its own. A
triangle whose sides are all inner may be a hole; then the three parts that it holds together fit by themselves, and
with one c, that of all other pieces. Each is tried alone, in its piece; where several are holes, parts beyond them
agree in another c, with which the whole is read again, unless a piece with entries to spare tells that c is right.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...matrix import OperatorMatrix
from ...topology import Numbering, Piece, Polygons, Topology
from ...topology.keys import contains, pair_keys
from ..agreement import SAME_SCALE, common_values
from ..by_component import with_pieces
from ..candidates.cell_set import CellSet
from ..covers.covering import MOST_VERTICES
from ..reading import FITS, NEARLY, Reading
from .corners import Alternative
from .rereading import cells_of, with_another_scale

_WORK = 1e5  # triangles times trials in all components together: a few seconds
_MOST_SCALES = 8


def filled_holes(stored: OperatorMatrix, topology: Topology, factors: NDArray, agree: float) -> list[Alternative]:
    """Triangles of loose pieces without which the matrix is given back, too; c is not known.

    Where there are too many triangles to try, and where one of a large component might be, one that is not tried stands
    for all of them.

    Parameters
    ----------
    stored : OperatorMatrix
    topology : Topology
        Of the mesh that was found.
    factors : (n,) float64
        c of the piece of each row.
    agree : float
        Relative difference of numbers that noise may cause.
    """
    if not any(piece.redundancy <= 0 for piece in topology.pieces):
        return []
    found, work = [], _WORK
    for part, pieces in with_pieces(stored.n, stored.edges, topology.pieces):
        suspects = [(piece, triangle) for piece in pieces for triangle in _suspects(piece)]
        work -= sum(len(piece.triangles) for piece, _ in suspects)
        if suspects and work < 0:
            found.append(_without([suspects[0][1]], tested=False))
        elif suspects:
            found += _holes(stored, part, pieces, suspects, float(factors[part.vertices[0]]), agree)
    return found


def _without(triangles: list[tuple[int, ...]], *, tested: bool = True) -> Alternative:
    return Alternative((), (), (), tuple(triangles), (), same_scale=False, tested=tested)


def _holes(
    stored: OperatorMatrix,
    part: Numbering,
    pieces: list[Piece],
    suspects: list[tuple[Piece, tuple[int, ...]]],
    c: float,
    agree: float,
) -> list[Alternative]:
    """Triangles of a component that may be holes together; none if all must be cells."""
    weights = -stored.entries[part.edge_rows]
    sign = float(np.sign(weights.sum()))
    same = max(SAME_SCALE, agree)
    scales, places = [], []
    for piece, triangle in suspects:
        reading = _without_one(stored, piece, triangle)
        parts = [(rest, mesh.scale) for rest, mesh in zip(reading.pieces, reading.meshes, strict=True) if mesh]
        if reading.nearly_fits(agree) and (len(pieces) == 1 or abs(parts[0][1] / c - 1) < same):
            return [_without([triangle])]
        for rest, scale in parts:
            if sign * scale > 0:
                scales.append(sign * scale)
                places.append(int(piece.edge_rows[rest.edge_rows].min()))
    if any(piece.redundancy > 0 for piece in pieces):
        return []
    common = common_values(np.array(scales), np.array(places, dtype=np.int64), max(FITS, agree))[:_MOST_SCALES]
    others = [sign * float(other) for other in common if abs(sign * other / c - 1) > same]
    first = suspects[0][1]
    if len(part.vertices) > MOST_VERTICES:
        return [_without([first], tested=False)] if others else []
    errors = None if stored.errors is None else stored.errors[part.edge_rows]
    whole = with_another_scale(part, weights, errors, c, others)
    if whole is None:  # with noise no reading fits as it is
        return [_without([first])] if len(common) and agree > NEARLY else []
    kept = cells_of(whole, part)
    return [_without([triangle for _, triangle in suspects if triangle not in kept] or [first])]


def _without_one(stored: OperatorMatrix, piece: Piece, triangle: tuple[int, ...]) -> Reading:
    """The rest of a piece, which may be several."""
    corners = np.sort(piece.vertices[piece.triangles], axis=1)
    rest = piece.triangles[(corners != triangle).any(axis=1)]
    known, own = pair_keys(stored.n, *stored.edges.T), pair_keys(stored.n, *piece.vertices[piece.edges].T)
    weights = np.zeros(len(own))
    there = contains(known, own)
    weights[there] = -stored.entries[np.searchsorted(known, own[there])]
    order = np.argsort(pair_keys(piece.n_vertices, *piece.edges.T))
    cells = Polygons(np.arange(0, 3 * len(rest) + 1, 3), rest.ravel())
    none = np.zeros(len(rest), dtype=bool)
    some = CellSet(piece.n_vertices, np.sort(piece.edges, axis=1)[order], weights[order], None, cells, none)
    return Reading.of(some, ~none)


def _suspects(piece: Piece) -> Iterator[tuple[int, ...]]:
    """Triangles with three inner sides, if the piece is loose."""
    if piece.redundancy <= 0:
        for triangle in np.sort(piece.vertices[piece.triangles[piece.enclosed]], axis=1).tolist():
            yield tuple(triangle)
