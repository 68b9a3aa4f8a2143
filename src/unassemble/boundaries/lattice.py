"""A grid continued beyond the rows of the matrix: parallelograms in rows and columns, or halves of these.

If G is c sqrt(det g) times the inverse of the metric g of a cell, then with steps h_i and k_j G11 = s k_j / h_i, G22 =
s h_i / k_j and G12 = t, s and t the same in all cells, c^2 = s^2 - t^2. Entries are linear in G: diagonals give t, and
an edge along x with half of all entries on diagonals beside it is -s (k_{j-1} + k_j) / (2 h_i), a product of what
depends on i and on j. So is one along y; each gives steps up to a factor, which sums of two steps settle. Steps beyond
the rows, and which cells there are, show in the entries along the rim.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..matrix import OperatorMatrix
from ..tolerances import ALIKE, CERTIFIED, ROUNDED
from ..topology.keys import Grouped, contains, distinct, found, pair_keys
from .grid import Grid


@dataclass(frozen=True, eq=False)
class _Kind:
    """Cells of a grid."""

    corners: NDArray[np.int64]  # (shapes, k, 2) counter-clockwise
    pairs: NDArray[np.int64]  # (p, 3) corners that have an entry, and its direction, a row of :data:`.grid.STEPS`
    part: NDArray[np.float64]  # (directions, 3) what a cell adds to an entry, by (G11, G22, G12)


_SQUARE = np.array([[(0, 0), (1, 0), (1, 1), (0, 1)]])
_SIDES = ((0, 1, 0), (1, 2, 1), (2, 3, 0), (3, 0, 1))
_KINDS = {
    # Rectangles: linear elements on either half, whose entry on the diagonal vanishes.
    4: _Kind(_SQUARE, np.array(_SIDES), -np.eye(2, 3) / 2),
    6: _Kind(
        np.array([[(0, 0), (1, 0), (0, 1)], [(1, 1), (0, 1), (1, 0)]]),
        np.array([(0, 1, 0), (0, 2, 1), (1, 2, 2)]),
        np.array([(-1, 0, -1), (0, -1, -1), (0, 0, 1)]) / 2,
    ),
    # Bilinear elements.
    8: _Kind(
        _SQUARE,
        np.array([*_SIDES, (0, 2, 2), (1, 3, 3)]),
        np.array([(-2, 1, 0), (1, -2, 0), (-1, -1, -3), (-1, -1, 3)]) / 6,
    ),
}


@dataclass(frozen=True, eq=False)
class Lattice:
    """Cells on rows of a matrix, and on vertices that it lacks."""

    bilinear: bool  # cells with entries on both diagonals
    scale: float  # c
    z: NDArray[np.complex128]  # (n + g,) positions of the rows, then of the vertices that are gone
    cells: NDArray[np.int64]  # (m, 3 or 4) all of them, counter-clockwise
    beyond: sp.csr_array  # (n, g) entries that rows had in columns that are gone
    added: NDArray[np.float64]  # (n,) what diagonal entries have besides: a multiple of the area of the cells at a row

    @property
    def like_mass(self) -> bool:
        """Whether what diagonal entries have besides is that of a consistent mass matrix on another lattice, too."""
        return self.cells.shape[1] == 3 and bool(self.added.any())

    @classmethod
    def of(cls, matrix: OperatorMatrix) -> Lattice | None:
        """The lattice that a matrix may belong to; None where its graph is no grid, or no sizes of cells fit."""
        vanished = np.abs(matrix.entries) <= ROUNDED * matrix.row_size[matrix.edges].min(axis=1)
        for stored in (matrix.without(vanished), *[matrix] * bool(vanished.any())):
            grid = Grid.of(matrix.n, stored.edges)
            if grid is not None:
                return next((one for turned in grid.turned() if (one := cls._on(stored, turned)) is not None), None)
        return None

    @classmethod
    def _on(cls, matrix: OperatorMatrix, grid: Grid) -> Lattice | None:
        """The same on a grid; None where no sizes fit."""
        n, kind = matrix.n, _KINDS[grid.neighbours]
        at, cells = _around(grid.at, kind)
        one, other, direction = kind.pairs.T
        key = matrix.edges @ [len(at), 1]
        edge, stored = found(key, pair_keys(len(at), cells[:, one], cells[:, other]))
        edge = np.where(stored, edge, -1)
        sizes = _sizes(matrix, grid, kind, edge[stored.all(axis=1)])
        if sizes is None:
            return None
        s, t, x, y = sizes
        scale = float(np.sign(s) * np.sqrt(s**2 - t**2))
        column, row = at.T
        z = np.append(0, np.cumsum(x))[column] + (1j * scale - t) / s * np.append(0, np.cumsum(y))[row]
        h, k = x[column[cells].min(axis=1)], y[row[cells].min(axis=1)]
        parts = (np.column_stack([s * k / h, s * h / k, np.full(len(h), t)]) @ kind.part.T)[:, direction]
        diagonal = -parts @ (np.eye(cells.shape[1])[one] + np.eye(cells.shape[1])[other])
        present, added = _present(matrix, cells, edge, parts, diagonal, h * k)
        cells, parts = cells[present], parts[present]
        used = np.arange(len(at)) < n
        used[cells] = True
        cells = (np.cumsum(used) - 1)[cells]
        rows, columns = cells[:, np.append(one, other)], cells[:, np.append(other, one)]
        out = (rows < n) & (columns >= n)
        beyond = sp.coo_array((np.tile(parts, 2)[out], (rows[out], columns[out] - n)), shape=(n, int(used.sum()) - n))
        return cls(grid.neighbours == 8, scale, z[used], cells, beyond.tocsr(), added)


def _around(at: NDArray[np.int64], kind: _Kind) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Coordinates from 0 of rows, then of all vertices beside them; and all cells with a row among their corners."""
    width = int(np.ptp(at[:, 1])) + 3
    own = (at - at.min(axis=0) + 1) @ [width, 1]
    wanted = np.concatenate([distinct(own[:, None] - shape)[:, None] + shape for shape in kind.corners @ [width, 1]])
    gone = distinct(wanted)
    values = np.concatenate([own, gone[~contains(np.sort(own), gone)]])
    order = np.argsort(values)
    return np.column_stack(np.divmod(values, width)), order[np.searchsorted(values, wanted, sorter=order)]


def _sizes(
    matrix: OperatorMatrix, grid: Grid, kind: _Kind, inside: NDArray[np.int64]
) -> tuple[float, float, NDArray[np.float64], NDArray[np.float64]] | None:
    """s, t, and steps along both axes, one more at either end; None where entries are no products, or leave them open.

    `inside` (m, p): edges of cells all of which have entries.
    """
    entries, number = matrix.entries, np.bincount(inside.ravel(), minlength=len(matrix.edges))
    across = kind.pairs[:, 2] > 1
    half = np.repeat(entries[inside[:, across]].sum(axis=1) / 2, np.count_nonzero(~across))
    weight = -entries - np.bincount(inside[:, ~across].ravel(), half, len(entries))
    whole = number == len(kind.corners) * np.bincount(kind.pairs[:, 2])[grid.step]
    start = (grid.at - grid.at.min(axis=0))[matrix.edges].min(axis=1)
    products = []
    for axis in (0, 1):
        some = whole & (grid.step == axis)
        factors = _factors(start[some, axis], start[some, 1 - axis], weight[some], int(np.ptp(grid.at[:, axis])))
        if factors is None:
            return None
        products.append(factors)
    (x, line_x, sum_y), (y, line_y, sum_x) = products
    up, down = np.median(sum_y / (y[line_x] + y[line_x + 1])), np.median(sum_x / (x[line_y] + x[line_y + 1]))
    s = float(2 * np.sign(up) * np.sqrt(up * down)) if up * down > 0 else 0.0
    diagonals = [np.median(entries[whole & (grid.step == d)]) for d in range(2, len(kind.part))]
    t = float(np.dot(np.sign(kind.part[2:, 2]), diagonals))
    if not abs(s) > abs(t):
        return None
    sizes = [x, y * np.sqrt(up / down)]
    for axis in (0, 1):
        for line, end, step in ((0, 0, 1), (len(sizes[axis]) - 2, -1, -2)):
            rim = (grid.step == 1 - axis) & (start[:, axis] == line) & (number == 1)
            along, cell = sizes[1 - axis][1 + start[rim, 1 - axis]], sizes[axis][step]
            own, turned, skewed = kind.part[1 - axis, [1 - axis, axis, 2]]
            rest = entries[rim] / s - own * cell / along - turned * along / cell - skewed * t / s
            gone = np.abs(rest) > ALIKE * np.abs(entries[rim] / s)
            # What a cell of a width r times the length of the edge adds: own r + turned / r + what is skewed.
            half = rest[gone] - skewed * t / s
            root = np.abs(half) + np.sqrt(half**2 - 4 * own * turned)
            with np.errstate(invalid="ignore"):
                ratio = np.where(half > 0, 2 * turned / root, root / (-2 * own))
            if gone.any():
                sizes[axis][end] = np.median(ratio * along[gone])
    return (s, t, sizes[0], sizes[1]) if all((own > 0).all() for own in sizes) else None


def _factors(
    i: NDArray[np.int64], j: NDArray[np.int64], value: NDArray[np.float64], n: int
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]] | None:
    """Steps a (n + 2,), lines j and b there, with values b[j] / a[i]: up to a factor; None unless of one sign.

    Steps that no value ties to most, and those at both ends, are as the nearest ones.
    """
    if not len(value) or not (np.sign(value) * np.sign(value[0]) > 0).all():
        return None
    pairs = sp.csr_array((value, (i, n + j)), shape=(n + int(j.max()) + 1,) * 2)
    order, before = csgraph.breadth_first_order(pairs, np.bincount(i).argmax(), directed=False)
    later = order[1:]
    ratios = np.asarray((pairs + pairs.T)[later, before[later]])
    size = np.full(pairs.shape[0], np.nan)
    size[order[0]] = 1
    for node, parent, ratio in zip(later.tolist(), before[later].tolist(), ratios.tolist(), strict=True):
        size[node] = size[parent] * ratio if node >= n else size[parent] / ratio
    a, b = size[:n], size[n:]
    if (np.abs(b[j] / a[i] - value) > CERTIFIED * np.abs(value)).any():
        return None
    known, lines = (np.flatnonzero(np.isfinite(part)) for part in (a, b))
    return np.interp(np.arange(-1, n + 1), known, a[known]), lines, b[lines]


def _present(
    matrix: OperatorMatrix, cells: NDArray[np.int64], edge: NDArray[np.int64], parts: NDArray, diagonal: NDArray,
    area: NDArray,
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:  # fmt: skip
    """Which cells there are, and what diagonal entries have besides, (n,): a multiple of a lumped mass matrix.

    Cells add `parts`, (m, p), to the entries of `edge`, (m, p), -1 for none, and `diagonal`, (m, k), to those of their
    corners, and have `area`, (m,), up to a factor. Where an entry is that of one cell only it is the one with more
    rows. Cells of a single row show in its diagonal entry.
    """
    n, own = matrix.n, cells < matrix.n
    rows, tolerance = own.sum(axis=1), CERTIFIED * matrix.row_size
    cell, pair = np.nonzero(edge >= 0)
    at, part = edge[cell, pair], parts[cell, pair]
    entry, near = matrix.entries[at], tolerance[matrix.edges[at]].min(axis=1)
    shown = (np.abs(entry - part) <= near) & (2 * rows[cell] > np.bincount(at, rows[cell])[at])
    shown |= np.abs(entry - np.bincount(at, part)[at]) <= near
    present = np.zeros(len(cells), dtype=bool)
    present[cell[shown & (np.abs(part) > near)]] = True
    missing = np.bincount(cells[~present][own[~present]], minlength=n) > 0
    rest = matrix.diagonal - _sums(cells, diagonal, present, n)
    mass = np.broadcast_to(area[:, None], cells.shape)
    inside = _sums(cells, mass, present, n)
    density = np.median(rest[~missing] / inside[~missing]) if not missing.all() else 0.0
    density *= (np.abs(density * inside) > tolerance)[~missing].any()
    diagonal, rest = diagonal + density * mass, rest - density * inside
    alone = np.flatnonzero(~present & (rows == 1))
    row, adds = cells[alone].min(axis=1), diagonal[alone, cells[alone].argmin(axis=1)]
    at_row = Grouped(row, n)
    for k in distinct(row).tolist():  # all of them, but where a boundary that is gone meets one that is not
        here = at_row.order[at_row.start[k] : at_row.start[k + 1]]
        for chosen in product((True, False), repeat=len(here)):
            if abs(rest[k] - adds[here] @ chosen) <= tolerance[k]:
                present[alone[here]] = chosen
                break
    return present, density * _sums(cells, mass, present, n)


def _sums(cells: NDArray, parts: NDArray, some: NDArray[np.bool_], n: int) -> NDArray[np.float64]:
    """(n,) what some cells add at each row."""
    return np.asarray(np.bincount(cells[some].ravel(), parts[some].ravel(), int(cells.max()) + 1)[:n], dtype=np.float64)
