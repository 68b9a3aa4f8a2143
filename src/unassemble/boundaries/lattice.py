"""A grid continued beyond the rows of the matrix: parallelograms that are all alike, or halves of these.

If G is c sqrt(det g) times the inverse of the metric g of a cell, entries are linear in G, whose determinant is c^2:
those of edges along either axis and of diagonals give it. Which cells there are shows in the entries along the rim.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..tolerances import CERTIFIED, ROUNDED
from ..topology.keys import Grouped, contains, distinct, found, pair_keys
from .grid import Grid


@dataclass(frozen=True, eq=False)
class _CellKind:
    """Cells of a grid."""

    corners: NDArray[np.int64]  # (shapes, k, 2) counter-clockwise
    pairs: NDArray[np.int64]  # (p, 3) corners that have an entry, and its direction, a row of :data:`.grid.STEPS`
    part: NDArray[np.float64]  # (directions, 3) what a cell adds to an entry, by (G11, G22, G12)


_SQUARE = np.array([[(0, 0), (1, 0), (1, 1), (0, 1)]])
_SIDES = ((0, 1, 0), (1, 2, 1), (2, 3, 0), (3, 0, 1))
_KINDS = {
    # Rectangles: linear elements on either half, whose entry on the diagonal vanishes.
    4: _CellKind(_SQUARE, np.array(_SIDES), -np.eye(2, 3) / 2),
    6: _CellKind(
        np.array([[(0, 0), (1, 0), (0, 1)], [(1, 1), (0, 1), (1, 0)]]),
        np.array([(0, 1, 0), (0, 2, 1), (1, 2, 2)]),
        np.array([(-1, 0, -1), (0, -1, -1), (0, 0, 1)]) / 2,
    ),
    # Bilinear elements.
    8: _CellKind(
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
        """The lattice that a matrix may belong to; None where its graph is no grid, or cells are not alike."""
        vanished = np.abs(matrix.entries) <= ROUNDED * matrix.row_size[matrix.edges].min(axis=1)
        for stored in (matrix.without(vanished), *[matrix] * bool(vanished.any())):
            grid = Grid.of(matrix.n, stored.edges)
            if grid is not None:
                return cls._on(stored, grid)
        return None

    @classmethod
    def _on(cls, matrix: OperatorMatrix, grid: Grid) -> Lattice | None:
        """The same on a grid; None where its cells are not alike."""
        n, kind = matrix.n, _KINDS[grid.neighbours]
        at, cells = _around(grid.at, kind)
        one, other, direction = kind.pairs.T
        key = matrix.edges @ [len(at), 1]
        edge, stored = found(key, pair_keys(len(at), cells[:, one], cells[:, other]))
        edge = np.where(stored, edge, -1)
        around = len(kind.corners) * np.bincount(direction)  # cells at an edge inside, by its direction
        inside = np.bincount(edge[stored.all(axis=1)].ravel(), minlength=len(key)) == around[grid.step]
        entries, step = matrix.entries[inside], grid.step[inside]
        typical = np.array([np.median(entries[step == d]) if (step == d).any() else np.nan for d in range(len(around))])
        if not (np.abs(entries - typical[step]) <= CERTIFIED * np.abs(entries)).all() or not np.isfinite(typical).all():
            return None
        metric = np.linalg.lstsq(kind.part * around[:, None], typical, rcond=None)[0]
        across, along, t = metric
        if not across * along > t**2:
            return None
        scale = float(np.sign(across) * np.sqrt(across * along - t**2))
        z = at[:, 0] + (1j * scale - t) / along * at[:, 1]
        parts = np.tile((kind.part @ metric)[direction], (len(cells), 1))
        diagonal = -parts @ (np.eye(cells.shape[1])[one] + np.eye(cells.shape[1])[other])
        present, added = _present(matrix, cells, edge, parts, diagonal)
        cells, parts = cells[present], parts[present]
        used = np.arange(len(at)) < n
        used[cells] = True
        cells = (np.cumsum(used) - 1)[cells]
        rows, columns = cells[:, np.append(one, other)], cells[:, np.append(other, one)]
        out = (rows < n) & (columns >= n)
        beyond = sp.coo_array((np.tile(parts, 2)[out], (rows[out], columns[out] - n)), shape=(n, int(used.sum()) - n))
        return cls(grid.neighbours == 8, scale, z[used], cells, beyond.tocsr(), added)


def _around(at: NDArray[np.int64], kind: _CellKind) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Coordinates from 0 of rows, then of all vertices beside them; and all cells with a row among their corners."""
    width = int(np.ptp(at[:, 1])) + 3
    own = (at - at.min(axis=0) + 1) @ [width, 1]
    wanted = np.concatenate([distinct(own[:, None] - shape)[:, None] + shape for shape in kind.corners @ [width, 1]])
    gone = distinct(wanted)
    values = np.concatenate([own, gone[~contains(np.sort(own), gone)]])
    order = np.argsort(values)
    return np.column_stack(np.divmod(values, width)), order[np.searchsorted(values, wanted, sorter=order)]


def _present(
    matrix: OperatorMatrix, cells: NDArray[np.int64], edge: NDArray[np.int64], parts: NDArray, diagonal: NDArray
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Which cells there are, and what diagonal entries have besides, (n,): a multiple of a lumped mass matrix.

    Cells add `parts`, (m, p), to the entries of `edge`, (m, p), -1 for none, and `diagonal`, (m, k), to those of their
    corners. Where an entry is that of one cell only it is the one with more rows. Cells of a single row show in its
    diagonal entry.
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
    mass = np.ones(cells.shape)
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
