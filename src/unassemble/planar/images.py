"""Mirror images of pieces that close rings, found piece by piece.

Pieces are taken one after the other, each time the one that shares most vertices with those before. Of the images of
the pieces so far only those remain with which these close; where the matrix does not tell yet, both do.
"""

from __future__ import annotations

import heapq
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
                turned for turned in grown if _meet(around, [_image(positions[p], turned[p]) for p in taken], closed)
            ]
        chosen = grown[:_WIDTH]
    return chosen


def _image(z: NDArray, turned: np.bool_) -> NDArray[np.complex128]:
    return np.asarray(np.conj(z) if turned else z)


def _order(vertices: Sequence[NDArray[np.int64]]) -> list[int]:
    """Pieces, each sharing as many vertices as possible with those before."""
    every = np.concatenate(vertices) if len(vertices) else np.empty(0, np.int64)
    piece = np.repeat(np.arange(len(vertices)), [len(v) for v in vertices])
    at: dict[int, list[int]] = {int(vertex): [] for vertex in every}
    for vertex, p in zip(every.tolist(), piece.tolist(), strict=True):
        at[vertex].append(p)
    shared = [0] * len(vertices)
    waiting = [(0, -len(v), p) for p, v in enumerate(vertices)]
    heapq.heapify(waiting)
    order: list[int] = []
    taken = np.zeros(len(vertices), dtype=bool)
    while waiting:
        count, _, p = heapq.heappop(waiting)
        if taken[p] or -count != shared[p]:  # it was entered again since, sharing more
            continue
        taken[p] = True
        order.append(p)
        for vertex in vertices[p].tolist():
            for other in at.pop(vertex, ()):
                shared[other] += 1
                heapq.heappush(waiting, (-shared[other], -len(vertices[other]), other))
    return order


def _meet(vertices: Sequence[NDArray[np.int64]], positions: Sequence[NDArray[np.complex128]], closed: float) -> bool:
    """Whether pieces meet at shared vertices, the first of them being held, without shrinking to points."""
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
    extent = np.abs(z).max()
    size = np.array([np.abs(at).max() for at in positions[1:]])
    small = np.abs(1 + solution[: n - 1]) * size <= closed * extent
    return not small.any() and bool(np.abs(system @ solution - rhs).max(initial=0.0) <= closed * extent)
