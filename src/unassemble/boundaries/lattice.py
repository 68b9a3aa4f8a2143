"""A grid whose cells are all alike, continued beyond the rows of the matrix.

Rows with whole surroundings all have the same entries. They give c and the shape of a cell: if G is c sqrt(det g) times
the inverse of the metric g of a cell, entries are linear in G, and det G = c^2 in the plane. Which cells there are at
the rim then shows in the entries there, of which each of two cells on an edge has half. Corners of cells that are no
rows were vertices of a boundary that is gone.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..tolerances import CERTIFIED
from .grid import Grid


@dataclass(frozen=True, eq=False)
class _Kind:
    """Cells of a grid."""

    corners: NDArray[np.int64]  # (shapes, k, 2) counter-clockwise
    pairs: tuple[tuple[int, int, int], ...]  # which corners have an entry, and a direction of :data:`.grid.STEPS`
    sharing: tuple[int, ...]  # number of cells that share an edge of each direction
    stencil: NDArray[np.float64]  # (directions, 3) entries of a row by (G11, G22, G12)


_SQUARE = np.array([[(0, 0), (1, 0), (1, 1), (0, 1)]])
_SIDES = ((0, 1, 0), (1, 2, 1), (2, 3, 0), (3, 0, 1))
_KINDS = {
    # Squares, rectangles: linear elements on either half, whose entry on the diagonal vanishes.
    4: _Kind(_SQUARE, _SIDES, (2, 2), -np.array([(1.0, 0, 0), (0, 1, 0)])),
    6: _Kind(
        np.array([[(0, 0), (1, 0), (0, 1)], [(1, 1), (0, 1), (1, 0)]]),
        ((0, 1, 0), (0, 2, 1), (1, 2, 2)),
        (2, 2, 2),
        -np.array([(1.0, 0, 1), (0, 1, 1), (0, 0, -1)]),
    ),
    # Bilinear elements.
    8: _Kind(
        _SQUARE,
        (*_SIDES, (0, 2, 2), (1, 3, 3)),
        (2, 2, 1, 1),
        -np.array([(4.0, -2, 0), (-2, 4, 0), (1, 1, 3), (1, 1, -3)]) / 6,
    ),
}


@dataclass(frozen=True, eq=False)
class Lattice:
    """Cells on rows of a matrix, and on vertices that it lacks."""

    neighbours: int  # of a row inside, see :class:`.grid.Grid`; eight where cells are bilinear
    scale: float  # c
    z: NDArray[np.complex128]  # (n + g,) positions of the rows, then of the vertices that are gone
    cells: NDArray[np.int64]  # (m, 3 or 4) all of them, counter-clockwise
    shift: float  # the multiple of the identity that rows inside have besides

    @classmethod
    def of(cls, matrix: OperatorMatrix) -> Lattice | None:
        """The lattice that a matrix may belong to; None where its graph is no grid, or rows inside differ."""
        grid = Grid.of(matrix.n, matrix.edges)
        if grid is None:
            return None
        kind = _KINDS[grid.neighbours]
        whole = np.array([np.median(matrix.entries[grid.step == d]) for d in range(len(kind.stencil))])
        metric = np.linalg.lstsq(kind.stencil, whole, rcond=None)[0]
        xx, yy, xy = metric.tolist()
        if not xx * yy > xy**2 or (np.abs(kind.stencil @ metric - whole) > CERTIFIED * np.abs(whole).max()).any():
            return None
        scale = float(np.sign(xx) * np.sqrt(xx * yy - xy**2))
        at, cells = _around(grid, kind)
        present, shift = _present(matrix, kind, whole, cells)
        used = np.arange(len(at)) < matrix.n
        used[cells[present]] = True
        number = np.cumsum(used) - 1
        z = at[used] @ np.array([1, (-xy + 1j * scale) / yy])
        return cls(grid.neighbours, scale, z, number[cells[present]], shift)


def rows_alike(matrix: OperatorMatrix) -> bool:
    """Whether most rows with all their neighbours have entries of the same size, and some rows do not add up to zero.

    Next to no work, and no other matrix is a lattice that has lost rows.
    """
    size, sums = np.zeros(matrix.n), matrix.row_sums
    for end in matrix.edges.T:
        size += np.bincount(end, np.abs(matrix.entries), matrix.n)
    degree = np.bincount(matrix.edges.ravel(), minlength=matrix.n)
    inside = size[degree == degree.max()]
    alike = np.abs(inside - np.median(inside)) <= CERTIFIED * np.median(inside)
    return bool(2 * np.count_nonzero(alike) >= len(alike) and (np.abs(sums) > CERTIFIED * size).any())


def _around(grid: Grid, kind: _Kind) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Coordinates of the rows, then of all vertices beside them; and all cells with a row among their corners."""
    low, width = grid.at.min(axis=0) - 2, int(np.ptp(grid.at[:, 1])) + 4
    corners = []
    for shape in kind.corners:
        anchors = (grid.at[:, None] - shape).reshape(-1, 2)
        _, first = np.unique((anchors - low) @ [width, 1], return_index=True)
        corners.append(anchors[first, None] + shape)
    at = np.concatenate(corners)
    wanted, own = (at - low) @ [width, 1], (grid.at - low) @ [width, 1]
    order = np.argsort(own)
    cells = order[np.searchsorted(own, wanted, sorter=order).clip(max=len(own) - 1)]
    gone = own[cells] != wanted
    _, first, ghost = np.unique(wanted[gone], return_index=True, return_inverse=True)
    cells[gone] = len(own) + ghost
    return np.concatenate([grid.at, at[gone][first]]), cells


def _present(matrix: OperatorMatrix, kind: _Kind, whole: NDArray, cells: NDArray) -> tuple[NDArray[np.bool_], float]:
    """Which cells there are, and the multiple of the identity that rows inside have besides.

    Where an entry is that of one cell only it is the one with more rows. Cells of a single row show in its diagonal
    entry.
    """
    n, own = matrix.n, cells < matrix.n
    rows, key = own.sum(axis=1), matrix.edges @ [n, 1]
    present = np.zeros(len(cells), dtype=bool)
    diagonal = np.zeros(cells.shape)  # what each cell has of the diagonal entries of its corners
    on_edge = np.zeros(len(key))  # rows of all cells there
    ends = []
    for p, q, d in kind.pairs:
        part = whole[d] / kind.sharing[d]
        diagonal[:, [p, q]] -= part
        some = np.flatnonzero(own[:, p] & own[:, q])
        edge = np.searchsorted(key, np.sort(cells[some][:, [p, q]], axis=1) @ [n, 1]).clip(max=len(key) - 1)
        on_edge += np.bincount(edge, rows[some], len(key))
        if abs(part) > CERTIFIED * np.abs(whole).max():
            ends.append((some, edge, np.rint(matrix.entries[edge] / part), kind.sharing[d]))
    for some, edge, count, sharing in ends:
        present[some] |= (count == sharing) | ((count == 1) & (2 * rows[some] > on_edge[edge]))
    alone = ~present & (rows == 1)
    missing = np.bincount(cells[~present][own[~present]], minlength=n) > 0
    rest = matrix.diagonal - _sums(cells, diagonal, present, n)
    shift = float(np.median(rest[~missing])) if not missing.all() else 0.0
    shift = shift if abs(shift) > CERTIFIED * np.abs(whole).max() else 0.0
    rest, tolerance = rest - shift, CERTIFIED * np.abs(whole).max()
    present[alone] = (np.abs(rest - _sums(cells, diagonal, alone, n)) <= tolerance)[cells[alone].min(axis=1)]
    # Where a boundary that is gone meets one that is not, some of them.
    for row in np.flatnonzero(np.abs(rest - _sums(cells, diagonal, present & alone, n)) > tolerance).tolist():
        here, corner = np.nonzero((cells == row) & alone[:, None])
        for chosen in product((False, True), repeat=len(here)):
            if abs(rest[row] - diagonal[here, corner] @ chosen) <= tolerance:
                present[here] = chosen
                break
    return present, shift


def _sums(cells: NDArray, parts: NDArray, some: NDArray[np.bool_], n: int) -> NDArray[np.float64]:
    """(n,) what some cells add at each row."""
    return np.asarray(np.bincount(cells[some].ravel(), parts[some].ravel(), int(cells.max()) + 1)[:n], dtype=np.float64)
