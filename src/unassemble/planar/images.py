"""Mirror images of pieces that close rings, found piece by piece.

Pieces are taken one after the other, each time the one that shares most vertices with those before. Of the images of
the pieces so far only those remain with which these close; where the matrix does not tell yet, both do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_WIDTH = 16  # choices of images that are followed
_MOST_SOLVES = 2000


def growing_images(
    vertices: Sequence[NDArray[np.int64]], positions: Sequence[NDArray[np.complex128]], closed: float
) -> list[NDArray[np.bool_]]:
    """Choices of mirror images with which all rings close, as far as they were followed.

    Parameters
    ----------
    vertices : list of (k_p,) int64
        Those of each piece that others share.
    positions : list of (k_p,) complex128
        Of these, in frames of their own.
    closed : float
        Distance at shared vertices, relative to the largest piece, below which rings count as closed.

    Returns
    -------
    list of (pieces,) bool
        Pieces to be turned over; empty if there is no such choice, or none was found.
    """
    order = _order(vertices)
    chosen = [np.zeros(len(vertices), dtype=bool)]
    solves = first = 0
    for last in range(1, len(order)):
        piece = order[last]
        together = np.isin(vertices[piece], np.concatenate([vertices[p] for p in order[first:last]])).sum()
        if together == 0:  # another group of pieces
            first = last
        if together == 0 or len(vertices[piece]) == 1:  # in no ring
            continue
        grown = []
        for turned in chosen:
            other = turned.copy()
            other[piece] = True
            grown += [turned, other]
        if together > 1:
            solves += len(grown)
            if solves > _MOST_SOLVES:
                return []
            taken = order[first : last + 1]
            around = [vertices[p] for p in taken]
            grown = [
                turned for turned in grown if _gap(around, [_image(positions[p], turned[p]) for p in taken]) <= closed
            ]
        chosen = grown[:_WIDTH]
    return chosen


def _image(z: NDArray, turned: np.bool_) -> NDArray[np.complex128]:
    return np.asarray(np.conj(z) if turned else z)


def _order(vertices: Sequence[NDArray[np.int64]]) -> list[int]:
    """Pieces, each sharing as many vertices as possible with those before."""
    left = set(range(len(vertices)))
    order: list[int] = []
    reached = np.empty(0, dtype=np.int64)
    while left:
        piece = max(left, key=lambda p: (int(np.isin(vertices[p], reached).sum()), len(vertices[p]), -p))
        left.remove(piece)
        order.append(piece)
        reached = np.union1d(reached, vertices[piece])
    return order


def _gap(vertices: Sequence[NDArray[np.int64]], positions: Sequence[NDArray[np.complex128]]) -> float:
    """How far apart pieces stay at shared vertices, the first of them being held."""
    n = len(vertices)
    piece = np.repeat(np.arange(n), [len(v) for v in vertices])
    vertex, z = np.concatenate(vertices), np.concatenate(positions)
    order = np.lexsort((piece, vertex))
    piece, vertex, z = piece[order], vertex[order], z[order]
    p = np.flatnonzero(vertex[1:] == vertex[:-1])
    q, row = p + 1, np.arange(len(p))
    system = np.zeros((len(p), 2 * n), dtype=np.complex128)
    system[row, piece[p]], system[row, piece[q]] = z[p], -z[q]
    system[row, n + piece[p]], system[row, n + piece[q]] = 1, -1
    rhs = z[q] - z[p]
    system = np.delete(system, [0, n], axis=1)
    solution = np.linalg.lstsq(system, rhs, rcond=1e-12)[0]
    return float(np.abs(system @ solution - rhs).max(initial=0.0) / np.abs(z).max())
