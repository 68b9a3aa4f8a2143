"""Meshes that other cells fit as well, with another factor c.

A mesh of one piece with v vertices, all of them on its boundary, and no hole has 2 v - 3 edges, vanished ones
counted: as many as unknowns, 2 v - 4 positions up to similarity and c. A hub closed by four right angles adds a
vertex inside and no condition, since these add up to a full turn by themselves. In such a mesh nothing is left to
tell the right cells from others with as many zeros: wherever parts hang together by right angles only, another order
of them fits with a c of its own, and two right angles in a zigzag fit as one cell on a half circle.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain, islice, pairwise

import numpy as np
from numpy.typing import NDArray

from ...errors import GeometryError, SolverError
from ...matrix import OperatorMatrix
from ...matrix.operator import row_sizes
from ...planar.cautious import count_flipped
from ...planar.conformal import ConformalOptions, conformal_map
from ...planar.cotangent import edge_weights
from ...topology import Piece
from ...topology.keys import with_sides
from ...topology.pieces import planar_pieces
from .corners import Alternative, Corners, cell
from .hubs import Hub

_WORK = 4e5  # vertices times trials
MOST_TRIALS = 60
SURE = 40  # triangles; the map of long strips of right triangles loses too many digits
_FITS = 1e-6
_OPTIONS = ConformalOptions(max_factorisations=4)


def is_loose(piece: Piece, closed: NDArray[np.int64]) -> bool:
    """Whether a piece has no more entries than unknowns, vanished ones counted, and c among the unknowns.

    `closed`, (n,), is 1 for rows that four right angles surround.
    """
    return piece.redundancy <= int(closed[piece.vertices].sum())


def other_reading(
    stored: OperatorMatrix, triangles: NDArray, corners: Corners, hubs: list[Hub], fits: float = _FITS
) -> Alternative | None:
    """Other cells for a loose piece that fit with a factor c of their own; found by trying.

    Where not all can be tried, or the piece is too large to be solved well, the first stands for them, untested.

    Parameters
    ----------
    stored : OperatorMatrix
        Without the vanished entries.
    triangles : (m, 3) int64
        All of the piece, those of divided polygons too.
    corners : Corners
        The right angles of the piece.
    hubs : list of Hub
        Those of the piece.
    fits : float
        Largest misfit, relative to the row, of cells that fit.
    """
    trials = int(np.clip(_WORK / max(len(triangles), 1), 2, MOST_TRIALS))
    whole = np.sort(triangles, axis=1)
    others = list(islice(chain(_orders(hubs), _folds(corners)), trials + 1))
    for alternative in others[:trials]:
        gone = {tuple(c) for c in alternative.cells}
        near = np.flatnonzero(np.isin(whole, list(alternative.around)).any(axis=1))
        kept = np.delete(triangles, [k for k in near if tuple(whole[k].tolist()) in gone], axis=0)
        fans = [(c[0], one, two) for c in alternative.other_cells for one, two in pairwise(c[1:])]
        added = np.array(fans, dtype=np.int64).reshape(-1, 3)
        if fits_as_one(stored, np.concatenate([kept, added]), alternative.around, fits):
            return alternative
    doubtful = len(others) > trials or (others and len(triangles) > SURE)
    return replace(others[0], tested=False) if doubtful else None


def _orders(hubs: list[Hub]) -> Iterator[Alternative]:
    for hub in hubs:
        for parts, closed in hub.orders():
            yield hub.to(parts, closed, same_scale=False)


def _folds(corners: Corners) -> Iterator[Alternative]:
    """Two right angles on either side of one edge, at its two ends: the corners of one cell on a half circle."""
    apexes: dict[int, list[int]] = {}
    for k, h in enumerate(corners.apex.tolist()):
        apexes.setdefault(h, []).append(k)
    for k, u in enumerate(corners.apex.tolist()):
        for v, a in _both_ways(corners, k):
            for j in apexes.get(v, []):
                for w, d in _both_ways(corners, j):
                    if u < v and w == u and d != a:
                        cells = (cell(u, frozenset((v, a))), cell(v, frozenset((u, d))))
                        yield Alternative((u, v), (a, u, v, d), (a, u, v, d), cells, ((a, u, v, d),), same_scale=False)


def _both_ways(corners: Corners, k: int) -> tuple[tuple[int, int], tuple[int, int]]:
    p, q = int(corners.first[k]), int(corners.second[k])
    return (p, q), (q, p)


def fits_as_one(stored: OperatorMatrix, triangles: NDArray, around: tuple[int, ...], most: float = _FITS) -> bool:
    """Whether these triangles make one planar piece that reproduces the entries."""
    rows, corner = np.unique(triangles, return_inverse=True)
    n, triangles = len(rows), corner.reshape(-1, 3)
    inside = np.isin(stored.edges, rows).all(axis=1)
    edges, given, opposite = with_sides(n, np.searchsorted(rows, stored.edges[inside]), triangles)
    weights = np.zeros(len(edges))
    weights[given] = -stored.entries[inside]
    pieces = planar_pieces(n, edges, triangles, opposite)
    if not pieces or len(pieces) > 1 or pieces[0].n_vertices < n or len(pieces[0].edges) < len(edges):
        return False
    piece = pieces[0]
    try:
        found = conformal_map(piece, weights[piece.edge_rows], sharp=False, options=_OPTIONS)
    except (GeometryError, SolverError):
        return False
    with np.errstate(all="ignore"):  # flat triangles fit nothing
        misfit = np.abs(found.scale * edge_weights(piece, found.z) - weights[piece.edge_rows])
    size = row_sizes(n, edges, np.abs(weights))[edges[piece.edge_rows]].min(axis=1)
    if not (misfit <= most * size).all() or count_flipped(piece, found.z):
        return False
    turns = np.zeros(n)
    a, b, c = found.z[piece.triangles].T
    for at, one, two, place in ((a, b, c, 0), (b, c, a, 1), (c, a, b, 2)):
        np.add.at(turns, piece.vertices[piece.triangles[:, place]], np.abs(np.angle((two - at) / (one - at))))
    return bool((turns[np.searchsorted(rows, around)] <= 2 * np.pi + 1e-6).all())
