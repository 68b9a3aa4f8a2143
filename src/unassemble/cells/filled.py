"""Triangles that may be holes of three edges: a mesh without inner vertices fits with one of them filled, as well.

Where a piece has no more entries than coordinates and c, every choice of its triangles fits, with a c of its own. A
triangle whose sides are all inner may be a hole; then the three parts that it holds together fit by themselves, and
with one c. Each is tried alone; where several are holes, parts beyond them agree in another c, with which the whole is
read again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..topology import Numbering, Piece, Polygons, Topology
from .agreement import common_values
from .by_component import with_pieces
from .cell_set import CellSet
from .corners import Alternative
from .covering import MOST_VERTICES
from .reading import FITS, NEARLY, Reading
from .rereading import cells_of, with_another_scale

_MOST_TRIALS = 60
_MOST_SCALES = 8


def filled_holes(stored: OperatorMatrix, topology: Topology, factors: NDArray, agree: float) -> list[Alternative]:
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
    agree : float
        Relative difference of numbers that noise may cause.
    """
    if not any(_suspects(topology.pieces)):
        return []
    found = []
    local = np.zeros(stored.n, dtype=np.int64)
    for part, pieces in with_pieces(stored.n, stored.edges, topology.pieces):
        suspects = list(_suspects(pieces))
        if not suspects:
            continue
        if len(part.vertices) > MOST_VERTICES:
            found.append(_without(suspects[:1], tested=False))
            continue
        local[part.vertices] = np.arange(len(part.vertices))
        triangles = np.concatenate([local[piece.vertices[piece.triangles]] for piece in pieces])
        weights = -stored.entries[part.edge_rows]
        holes = _holes(part, weights, triangles, suspects, local, float(factors[part.vertices[0]]), agree)
        if holes:
            found.append(_without(holes))
        elif len(suspects) > _MOST_TRIALS:
            found.append(_without(suspects[_MOST_TRIALS:][:1], tested=False))
    return found


def _without(triangles: list[tuple[int, ...]], *, tested: bool = True) -> Alternative:
    return Alternative((), (), (), tuple(triangles), (), same_scale=False, tested=tested)


def _holes(
    part: Numbering,
    weights: NDArray,
    triangles: NDArray[np.int64],
    suspects: list[tuple[int, ...]],
    local: NDArray[np.int64],
    c: float,
    agree: float,
) -> list[tuple[int, ...]]:
    """Triangles of a component that may be holes together; none if all must be cells.

    `triangles` are all of it, in its numbering, which `local`, (n,), gives for each row.
    """
    n = len(part.vertices)
    sign = float(np.sign(weights.sum()))
    scales, places = [], []
    for triangle in suspects[:_MOST_TRIALS]:
        rest = triangles[(np.sort(triangles, axis=1) != np.sort(local[list(triangle)])).any(axis=1)]
        cells = Polygons(np.arange(0, 3 * len(rest) + 1, 3), rest.ravel())
        some = CellSet(n, part.edges, weights, None, cells, np.zeros(len(rest), dtype=bool))
        reading = Reading.of(some, np.ones(len(rest), dtype=bool))
        if reading.nearly_fits(agree):
            return [triangle]
        for piece, mesh in zip(reading.pieces, reading.meshes, strict=True):
            if mesh and sign * mesh.scale > 0:
                scales.append(sign * mesh.scale)
                places.append(piece.edge_rows.min())
    common = common_values(np.array(scales), np.array(places, dtype=np.int64), max(FITS, agree))[:_MOST_SCALES]
    whole = with_another_scale(part, weights, c, [sign * float(other) for other in common])
    if whole is None:  # with noise no reading fits as it is
        return suspects[:1] if len(common) and agree > NEARLY else []
    kept = cells_of(whole, part)
    return [triangle for triangle in suspects if triangle not in kept] or suspects[:1]


def _suspects(pieces: Sequence[Piece]) -> Iterator[tuple[int, ...]]:
    """Triangles of loose pieces with three inner sides."""
    for piece in pieces:
        if piece.redundancy <= 0:
            inner = np.asarray((piece.facing[:, 1] >= 0)[piece.opposite].all(axis=1))
            for triangle in np.sort(piece.vertices[piece.triangles[inner]], axis=1).tolist():
                yield tuple(triangle)
