"""Bodies of one material: their matrix follows from the cells up to one factor, without solving for coefficients."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .elements import element_blocks

_AT_ONCE = 200_000  # pairs of corners


def reassembled(
    points: NDArray[np.float64], cells: NDArray[np.int64], order: int, ratio: float, keys: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Assemble cells with Lame coefficients (ratio, 1) into given pairs of nodes.

    Parameters
    ----------
    points : (n, d) float64
    cells : (m, k) int64
    order : int
        Gauss points per direction, for boxes.
    ratio : float
    keys : (e,) int64
        Pairs i < j as i n + j, increasing.

    Returns
    -------
    blocks : (e, d, d) float64
    seen : (m,) bool
        Cells that contribute to one of the pairs at least.
    """
    n, d = points.shape
    k = cells.shape[1]
    a, b = np.triu_indices(k, 1)
    total = np.zeros(len(keys) * d * d)
    seen = np.zeros(len(cells), dtype=bool)
    step = max(_AT_ONCE // k**2, 1)
    for start in range(0, len(cells), step):
        some = cells[start : start + step]
        first, second = element_blocks(points, some, order)
        part = (ratio * first + second)[:, a, b]
        i, j = some[:, a], some[:, b]
        part = np.where((i > j)[..., None, None], part.transpose(0, 1, 3, 2), part)
        key = np.minimum(i, j) * n + np.maximum(i, j)
        place = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
        there = keys[place] == key
        seen[start : start + step] = there.any(axis=1)
        where = place[there][:, None] * (d * d) + np.arange(d * d)
        total += np.bincount(where.ravel(), part[there].ravel(), len(total))
    return total.reshape(-1, d, d), seen
