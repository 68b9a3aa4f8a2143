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
import scipy.sparse as sp
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..tolerances import CERTIFIED, ROUNDED
from ..topology.keys import Grouped, found, pair_keys
from .grid import Grid
from .rectangles import steps


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
    rectangles: bool  # of different sizes; other cells are all alike
    scale: float  # c
    z: NDArray[np.complex128]  # (n + g,) positions of the rows, then of the vertices that are gone
    cells: NDArray[np.int64]  # (m, 3 or 4) all of them, counter-clockwise
    beyond: sp.csr_array  # (n, g) entries that rows had in columns that are gone
    added: NDArray[np.float64]  # (n,) what diagonal entries have besides: a multiple of the area of the cells at a row

    @classmethod
    def of(cls, matrix: OperatorMatrix) -> Lattice | None:
        """The lattice that a matrix may belong to; None where its graph is no grid, or no shapes of cells fit."""
        vanished = np.abs(matrix.entries) <= ROUNDED * matrix.row_size[matrix.edges].min(axis=1)
        bare = matrix.without(vanished)
        grid = Grid.of(matrix.n, bare.edges)
        if grid is not None:
            matrix = bare
        elif not vanished.any() or (grid := Grid.of(matrix.n, matrix.edges)) is None:
            return None
        kind = _KINDS[grid.neighbours]
        at, cells = _around(grid, kind)
        rectangles = _rectangles(matrix, grid, at, cells)
        shapes = rectangles or _alike(matrix, grid, at, cells)
        if shapes is None:
            return None
        scale, z, form = shapes
        a, b, c = z[cells[:, :3]].T
        parts = form @ (kind.stencil / np.array(kind.sharing)[:, None]).T
        present, added = _present(matrix, kind, parts, np.abs((np.conj(b - a) * (c - a)).imag), cells)
        n, used = matrix.n, np.arange(len(at)) < matrix.n
        used[cells[present]] = True
        cells, parts = (np.cumsum(used) - 1)[cells[present]], parts[present]
        one, other, which = np.array([*kind.pairs, *((q, p, d) for p, q, d in kind.pairs)]).T
        row, column = cells[:, one], cells[:, other] - n
        out = (row < n) & (column >= 0)
        beyond = sp.coo_array((parts[:, which][out], (row[out], column[out])), shape=(n, int(used.sum()) - n))
        return cls(grid.neighbours, rectangles is not None, scale, z[used], cells, beyond.tocsr(), added)


def sides_of(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """(s, 2) ends i < j of the sides of cells (m, k), each side once."""
    return np.unique(np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)), axis=0)


def _rectangles(
    matrix: OperatorMatrix, grid: Grid, at: NDArray[np.int64], cells: NDArray[np.int64]
) -> tuple[float, NDArray[np.complex128], NDArray[np.float64]] | None:
    """c, positions (k,), and (G11, G22, G12) of each cell, (m, 3), of a grid of rectangles; None where it is none."""
    sizes = None if grid.neighbours == 6 else steps(matrix, grid, cells[(cells < matrix.n).all(axis=1)])
    if sizes is None:
        return None
    scale, x, y = sizes
    column, row = (at - at.min(axis=0)).T
    z = np.append(0.0, np.cumsum(x))[column] + 1j * np.append(0.0, np.cumsum(y))[row]
    ratio = y[row[cells[:, 0]]] / x[column[cells[:, 0]]]
    return scale, z, scale * np.column_stack([ratio, 1 / ratio, np.zeros(len(ratio))])


def _alike(
    matrix: OperatorMatrix, grid: Grid, at: NDArray[np.int64], cells: NDArray[np.int64]
) -> tuple[float, NDArray[np.complex128], NDArray[np.float64]] | None:
    """c, positions (k,), and (G11, G22, G12) of each cell, (m, 3), where all are alike; None where they are not."""
    kind = _KINDS[grid.neighbours]
    whole = np.array([np.median(matrix.entries[grid.step == d]) for d in range(len(kind.stencil))])
    tolerance = CERTIFIED * np.abs(whole).max()
    if 2 * np.count_nonzero(np.abs(matrix.entries - whole[grid.step]) <= tolerance) < len(grid.step):
        return None
    form = np.linalg.lstsq(kind.stencil, whole, rcond=None)[0]
    xx, yy, xy = form.tolist()
    if not xx * yy > xy**2 or (np.abs(kind.stencil @ form - whole) > tolerance).any():
        return None
    scale = float(np.sign(xx) * np.sqrt(xx * yy - xy**2))
    return scale, at @ np.array([1, (-xy + 1j * scale) / yy]), np.broadcast_to(form, (len(cells), 3))


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


def _present(
    matrix: OperatorMatrix, kind: _Kind, parts: NDArray, area: NDArray, cells: NDArray
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Which cells there are, and what diagonal entries have besides, (n,): a multiple of a lumped mass matrix.

    Cells add `parts`, (m, directions), to the entries of their edges, and have `area`, (m,), up to a common factor.
    Where an entry is that of one cell only it is the one with more rows. Cells of a single row show in its diagonal
    entry.
    """
    n, own = matrix.n, cells < matrix.n
    rows, key = own.sum(axis=1), matrix.edges @ [n, 1]
    tolerance = CERTIFIED * matrix.row_size
    present = np.zeros(len(cells), dtype=bool)
    diagonal = np.zeros(cells.shape)  # what each cell has of the diagonal entries of its corners
    on_edge, both = np.zeros(len(key)), np.zeros(len(key))  # rows of all cells there, and what they add
    ends = []
    for p, q, d in kind.pairs:
        diagonal[:, [p, q]] -= parts[:, [d]]
        some = np.flatnonzero(own[:, p] & own[:, q])
        edge, stored = found(key, pair_keys(n, cells[some, p], cells[some, q]))
        some, edge = some[stored], edge[stored]
        on_edge += np.bincount(edge, rows[some], len(key))
        both += np.bincount(edge, parts[some, d], len(key))
        ends.append((some, edge, parts[some, d]))
    for some, edge, part in ends:
        entry, near = matrix.entries[edge], tolerance[matrix.edges[edge]].min(axis=1)
        alone = (np.abs(entry - part) <= near) & (2 * rows[some] > on_edge[edge])
        present[some] |= (alone | (np.abs(entry - both[edge]) <= near)) & (np.abs(part) > near)
    alone = ~present & (rows == 1)
    missing = np.bincount(cells[~present][own[~present]], minlength=n) > 0
    rest = matrix.diagonal - _sums(cells, diagonal, present, n)
    mass = np.broadcast_to(area[:, None], cells.shape)
    inside = _sums(cells, mass, present, n)
    density = np.median(rest[~missing] / inside[~missing]) if not missing.all() else 0.0
    if (np.abs(density * inside) > tolerance)[~missing].any():
        diagonal += density * mass
        rest -= density * inside
    else:
        density = 0.0
    present[alone] = (np.abs(rest - _sums(cells, diagonal, alone, n)) <= tolerance)[cells[alone].min(axis=1)]
    # Where a boundary that is gone meets one that is not, some of them.
    which = np.flatnonzero(alone)
    at_row = Grouped(cells[which].min(axis=1), n)
    wrong = np.abs(rest - _sums(cells, diagonal, present & alone, n)) > tolerance
    for row in np.flatnonzero(wrong & (np.diff(at_row.start) > 0)).tolist():
        here = which[at_row.order[at_row.start[row] : at_row.start[row + 1]]]
        corner = cells[here].argmin(axis=1)
        for chosen in product((False, True), repeat=len(here)):
            if abs(rest[row] - diagonal[here, corner] @ chosen) <= tolerance[row]:
                present[here] = chosen
                break
    return present, density * _sums(cells, mass, present, n)


def _sums(cells: NDArray, parts: NDArray, some: NDArray[np.bool_], n: int) -> NDArray[np.float64]:
    """(n,) what some cells add at each row."""
    return np.asarray(np.bincount(cells[some].ravel(), parts[some].ravel(), int(cells.max()) + 1)[:n], dtype=np.float64)
