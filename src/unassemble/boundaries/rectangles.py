"""Sizes of rectangles of a grid, each row and column of cells with a size of its own, from the entries.

With steps h_i and k_j the weight of an edge along x, on two cells, is c (k_{j-1} + k_j) / (2 h_i), of one along y
c (h_{i-1} + h_i) / (2 k_j): finite volumes, or linear elements on halves of the cells. Bilinear elements have the same
once the diagonal entries of both cells are added to that of the edge. Both are products of what depends on i and what
depends on j; each gives the steps up to a factor, and sums of two steps say what these factors are. Steps beyond the
rows show in the entries along the rim.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..matrix import OperatorMatrix
from ..tolerances import ALIKE, CERTIFIED
from ..topology.keys import found, pair_keys
from .grid import Grid


def steps(
    matrix: OperatorMatrix, grid: Grid, cells: NDArray[np.int64]
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]] | None:
    """The scale c, and steps along both axes of a grid of rectangles, one more at either end, of cells that are gone.

    Cells (m, 4) are those with all their corners, and rows inside have four or eight neighbours. None where entries are
    no products, or leave steps open.
    """
    bilinear = grid.neighbours == 8
    key = matrix.edges @ [matrix.n, 1]
    ends, stored = found(key, pair_keys(matrix.n, cells, cells[:, [1, 2, 3, 0]]))
    cells, ends = cells[stored.all(axis=1)], ends[stored.all(axis=1)].ravel()
    number = np.bincount(ends, minlength=len(key))
    weight = -matrix.entries
    if bilinear:
        across, stored = found(key, pair_keys(matrix.n, cells[:, :2], cells[:, 2:]))
        diagonal = np.where(stored, matrix.entries[across], 0.0)
        if (np.abs(np.diff(diagonal)) > CERTIFIED * np.abs(diagonal)).any():  # no right angles
            return None
        diagonal = diagonal.mean(axis=1)
        weight -= np.bincount(ends, np.repeat(diagonal, 4), len(key))
    at = grid.at - grid.at.min(axis=0)
    start = at[matrix.edges].min(axis=1)
    products = []
    for axis in (0, 1):
        inner = (grid.step == axis) & (number == 2)
        own, across = start[inner, axis], start[inner, 1 - axis]
        factors = _factors(own, across, weight[inner], int(at[:, axis].max()))
        if factors is None:
            return None
        products.append(factors)
    (h, across_x, k_sum), (k, across_y, h_sum) = products
    up, down = np.median(k_sum / (k[across_x - 1] + k[across_x])), np.median(h_sum / (h[across_y - 1] + h[across_y]))
    if not up * down > 0:
        return None
    c, k = 2 * np.sign(up) * np.sqrt(up * down), k * np.sqrt(up / down)
    sizes = [np.pad(h, 1), np.pad(k, 1)]
    for axis in (0, 1):
        along = 1 - axis
        for line, end, next_to in ((0, 0, 1), (len(sizes[axis]) - 2, -1, -2)):
            rim = (grid.step == along) & (start[:, axis] == line)
            other = sizes[along][1 + start[rim, along]]
            rest = matrix.entries[rim] / c - number[rim] * _part(sizes[axis][next_to] / other, bilinear=bilinear)
            gone = np.abs(rest) > ALIKE * np.abs(matrix.entries[rim] / c)
            root = np.sqrt(rest**2 + 2 / 9) + np.abs(rest)
            size = other * (1.5 * np.where(rest > 0, 2 / (9 * root), root) if bilinear else -2 * rest)
            sizes[axis][end] = np.median(size[gone]) if gone.any() else sizes[axis][next_to]
    if not all((own > 0).all() for own in sizes):
        return None
    return float(c), sizes[0], sizes[1]


def _part(ratio: NDArray[np.float64], *, bilinear: bool) -> NDArray[np.float64]:
    """What one cell adds to the entry of a side, for c = 1 and width over length of the side."""
    return 1 / (6 * ratio) - ratio / 3 if bilinear else -ratio / 2


def _factors(
    i: NDArray[np.int64], j: NDArray[np.int64], value: NDArray[np.float64], n: int
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]] | None:
    """Steps a (n,), lines j and b there, with values b[j] / a[i]: up to a factor; None unless joined and positive."""
    lines, j = np.unique(j, return_inverse=True)
    pairs = sp.csr_array((value, (i, n + j)), shape=(n + len(lines), n + len(lines)))
    order, before = csgraph.breadth_first_order(pairs, 0, directed=False)
    if not len(lines) or len(order) < pairs.shape[0] or (value == 0).any():
        return None
    later = order[1:]
    known = np.asarray((pairs + pairs.T)[later, before[later]])
    size = [1.0] * len(order)
    for node, parent, ratio in zip(later.tolist(), before[later].tolist(), known.tolist(), strict=True):
        size[node] = size[parent] * ratio if node >= n else size[parent] / ratio
    a, b = np.array(size[:n]), np.array(size[n:])
    if not ((a > 0).all() and (b * b[0] > 0).all()):
        return None
    fits = np.abs(b[j] / a[i] - value) <= CERTIFIED * np.abs(value)
    return (a, lines, b) if fits.all() else None
