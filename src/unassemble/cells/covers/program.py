"""Which numbered cells make a mesh: an integer program with an exact cover of every edge.

Each edge has the number that is all of its weight on one side, maybe with a right angle on the other, or two numbers
that add up to it. No two cells share two edges at a vertex, nor two corners a vanished side (they would be one
quadrilateral). Let p be the number of fans of cells about a vertex, its cells less the edges with a cell on both sides.
Its angles add up to at most a full turn, and to exactly that where p = 0. These conditions are necessary: what else
is wrong with a solution is to be excluded as a cut.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, milp

from ...linalg import quiet
from .numbered import Numbered

_ROUNDING = 1e-4  # of angle sums; far more than what HiGHS neglects, 1e-6 before it scales rows
_NODES = 1  # of the search tree: covers that fit come with its root, and branching takes ten times as long
_SECONDS = 20.0  # of one solution, for want of a better measure; roots of programs of this size take a few

Rows = tuple[sp.csr_array, NDArray, NDArray]


class Program:
    """The conditions on a choice of cells.

    Parameters
    ----------
    cells : Numbered
    """

    def __init__(self, cells: Numbered):
        self.cells = cells
        self._rows = _Conditions(cells)
        parts = [*self._rows.of_edges(), self._rows.of_wedges(), self._rows.of_vanished(), *self._rows.of_vertices()]
        self._matrix = sp.vstack([part[0] for part in parts]).tocsr()
        self._low, self._high = (np.concatenate([part[k] for part in parts]) for k in (1, 2))

    @property
    def fans(self) -> NDArray[np.float64]:
        """(m,) what each cell adds to the number of fans at all vertices: few belong to meshes that hang together."""
        return np.asarray(self._rows.fans.sum(axis=0)).ravel()[: len(self.cells.cell)]

    def exclude(self, together: NDArray[np.int64]) -> None:
        """Take not all of some cells."""
        row = np.zeros((1, self._matrix.shape[1]))
        row[0, together] = 1
        self._add(row, -np.inf, len(together) - 1)

    def solution(self, cost: NDArray[np.float64]) -> NDArray[np.int64] | None:
        """Rows of the cells (m,) of least cost that fulfil all conditions; None if none are found."""
        size = self._matrix.shape[1]
        with quiet():  # HiGHS has a line or two that no option turns off
            found = milp(
                np.append(cost, np.zeros(size - len(cost))),
                constraints=LinearConstraint(self._matrix, self._low, self._high),
                integrality=np.ones(size),
                bounds=Bounds(0, 1),
                options={"node_limit": _NODES, "time_limit": _SECONDS},
            )
        return None if found.x is None else np.flatnonzero(found.x[: len(cost)] > 0.5)

    def _add(self, row: NDArray, low: float, high: float) -> None:
        self._matrix = sp.vstack([self._matrix, sp.csr_array(row)]).tocsr()
        self._low, self._high = np.append(self._low, low), np.append(self._high, high)


class _Conditions:
    """Rows of the program; its variables are the cells and, after them, the pairs of numbers of each edge."""

    def __init__(self, cells: Numbered):
        self._cells = cells
        shapes = cells.shapes
        self._row, self._place = np.nonzero(cells.slot >= 0)  # every stored side
        slot = cells.slot[self._row, self._place]
        p = cells.far.shape[1]
        edge, column = np.divmod(slot, p)
        far = cells.far[edge, column]
        # A pair of numbers goes by the lower one; the first stands alone, or with a right angle.
        pair = edge * p + np.where(far >= 0, np.minimum(column, far), column)
        pairs, self._pair = np.unique(pair, return_inverse=True)
        self._edge_of_pair = pairs // p
        self._slot, self._twice, self._right = slot, far == column, (far == 0) & (column != 0)
        self._size = len(cells.cell) + len(pairs)
        vertices = shapes.vertices[cells.cell]
        cell, place = np.nonzero(vertices >= 0)
        vertex = vertices[cell, place]
        before = shapes.before[cells.cell][cell, place]
        stored = cells.slot >= 0
        at = stored[cell, place].astype(np.float64) + stored[cell, before]
        self.fans = self._sum(vertex, cell, 1 - at, shapes.n_vertices)
        self._angles = self._sum(vertex, cell, cells.corner_angles[cell, place], shapes.n_vertices)
        both = at == 2
        sides = np.sort(np.column_stack([cells.edge[cell, place], cells.edge[cell, before]])[both], axis=1)
        _, self._wedge = np.unique(sides @ [len(shapes.edges), 1], return_inverse=True)
        self._wedge_cell = cell[both]

    def of_edges(self) -> list[Rows]:
        """One pair of numbers for each edge, and cells that have them."""
        n_cells = len(self._cells.cell)
        slots, number = np.unique(self._slot, return_inverse=True)
        one = np.ones(len(number))
        wanted = np.zeros(len(slots))
        wanted[number] = np.where(self._twice, 2.0, 1.0)
        pair = np.zeros(len(slots), dtype=np.int64)
        pair[number] = self._pair
        right = np.zeros(len(slots), dtype=bool)
        right[number] = self._right
        taken = self._sum(number, self._row, one, len(slots))
        taken -= self._sum(np.arange(len(slots)), n_cells + pair, wanted, len(slots))
        e = len(self._cells.shapes.edges)
        pairs = np.arange(len(self._edge_of_pair))
        single = self._sum(self._edge_of_pair, n_cells + pairs, np.ones(len(pairs)), e)
        return [
            (taken, np.where(right, -np.inf, 0.0), np.zeros(len(slots))),
            (single, np.ones(e), np.ones(e)),
        ]

    def of_wedges(self) -> Rows:
        """Two edges at a vertex are sides of at most one cell."""
        n = int(self._wedge.max(initial=-1)) + 1
        return self._at_most_one(self._wedge, self._wedge_cell, n)

    def of_vanished(self) -> Rows:
        """A vanished side belongs to one corner."""
        keys = self._cells.shapes.vanished[self._cells.cell]
        cell = np.flatnonzero(keys >= 0)
        _, pair = np.unique(keys[cell], return_inverse=True)
        return self._at_most_one(pair, cell, int(pair.max(initial=-1)) + 1)

    def of_vertices(self) -> list[Rows]:
        """Angles add up to a full turn or, if the edges of a vertex are in fans, to less."""
        shapes = self._cells.shapes
        n = shapes.n_vertices
        degree = np.bincount(shapes.edges.ravel(), minlength=n)
        turn, many = 2 * np.pi, np.full(n, np.inf)
        return [
            (self._angles, -many, np.full(n, turn + _ROUNDING)),
            (self._angles + turn * self.fans, turn - _ROUNDING - turn * degree, many),
            (self.fans, -degree.astype(np.float64), many),
        ]

    def _at_most_one(self, row: NDArray, cell: NDArray, n: int) -> Rows:
        return self._sum(row, cell, np.ones(len(row)), n), np.full(n, -np.inf), np.ones(n)

    def _sum(self, row: NDArray, column: NDArray, value: NDArray, n: int) -> sp.csr_array:
        return sp.coo_array((value, (row, column)), shape=(n, self._size)).tocsr()
