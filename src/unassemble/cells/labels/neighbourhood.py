"""Labels turned over in one place: the vertices nearby are placed anew, the others stay.

A hole that changes places with the cell next to it moves a vertex by a good part of an edge, too far for a linear
response, and small enough to be tried: some twenty unknowns, dense.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .fitting import SMOOTH, Fitted, cost
from .sheet import Placed, Sheet

_DAMPING, _LEAST_DAMPING = 1e-3, 1e-6
_LONGEST_STEP = 0.5  # in edge lengths
_STEPS, _SLOW = 6, 0.97


@dataclass(frozen=True, eq=False)
class Trial:
    """Labels turned over.

    Attributes
    ----------
    cells : tuple of int
        Candidates turned over, others that gave way included.
    gain : float
        By how much the cost falls.
    vertices : (f,) int64
        That were placed anew.
    z : (f,) complex128
    """

    cells: tuple[int, ...]
    gain: float
    vertices: NDArray[np.int64]
    z: NDArray[np.complex128]


class Neighbourhoods:
    """What is near what on a sheet.

    Parameters
    ----------
    sheet : Sheet

    Attributes
    ----------
    touching : csr_array
        Chosen candidates that share a vertex.
    """

    def __init__(self, sheet: Sheet):
        self._sheet = sheet
        n, m, e, count = sheet.n_vertices, len(sheet.triangles), len(sheet.edges), sheet.candidates.count
        triangle = np.repeat(np.arange(m), 3)
        self.around_vertex = _incidence(sheet.triangles.ravel(), triangle, (n, m))
        self.facing_edge = _incidence(sheet.row.ravel(), triangle, (e, m))
        self.of_cell = _incidence(sheet.cell, np.arange(m), (count, m))
        ends = sheet.edges
        self.next_vertex = _incidence(ends.T.ravel(), ends[:, ::-1].T.ravel(), (n, n))
        corner = _incidence(np.repeat(sheet.cell, 3), sheet.triangles.ravel(), (count, n))
        self.touching = (corner @ corner.T).tocsr()
        cell, half = sheet.candidates.sides.T
        taken = _incidence(cell, half, (count, 2 * len(sheet.candidates.edges)))
        rivals = (taken @ taken.T).tocsr()
        self._rivals = [own.tolist() for own in np.split(rivals.indices, rivals.indptr[1:-1])]
        self._local = np.full(max(n, e), -1)

    def with_rivals(self, labels: Sequence[bool] | NDArray[np.bool_], cells: Sequence[int]) -> tuple[int, ...]:
        """The cells, and those that have to give way to the new ones among them."""
        gone = {other for k in cells if not labels[k] for other in self._rivals[k] if labels[other]}
        return tuple(sorted({*cells} | gone))

    def trial(self, fit: Fitted, cells: tuple[int, ...], *, rings: int = 1, redrawn: bool = False) -> Trial:
        """Turn labels over and place the vertices within some rings about them anew.

        They start from where they are or from the conformal map, whichever fits better; if `redrawn`, from both.
        """
        sheet = self._sheet
        vertices = np.unique(sheet.triangles[adjacent_to(self.of_cell, np.array(cells))])
        for _ in range(rings):
            vertices = np.union1d(vertices, adjacent_to(self.next_vertex, vertices))
        rows = np.unique(sheet.row[adjacent_to(self.around_vertex, vertices)])
        triangles = adjacent_to(self.facing_edge, rows)
        labels = fit.labels.copy()
        labels[list(cells)] ^= True
        patch = _Patch(sheet, fit.placed, labels, vertices, rows, triangles, self._local)
        starts = sorted((fit.placed.z[vertices], patch.conformal()), key=patch.cost_of)
        z, after = min((patch.improved(start) for start in starts[: 2 if redrawn else 1]), key=lambda end: end[1])
        return Trial(cells, float(cost(fit.misfit[rows]).sum()) - after, vertices, z)


class _Patch:
    """Equations of the edges `rows` for the positions of `vertices`."""

    def __init__(
        self,
        sheet: Sheet,
        placed: Placed,
        labels: NDArray[np.bool_],
        vertices: NDArray,
        rows: NDArray,
        triangles: NDArray,
        local: NDArray,
    ):
        triangles = triangles[labels[sheet.cell[triangles]]]
        t, self._ends = sheet.triangles[triangles], sheet.edges[rows]
        local[rows] = np.arange(len(rows))
        row = local[sheet.row[triangles]].ravel()
        local[rows] = -1
        local[vertices] = np.arange(len(vertices))
        self._corner, self._end = local[t], local[self._ends]  # -1 for vertices that stay
        local[vertices] = -1
        known = row >= 0
        self._kept, self._row = np.flatnonzero(known), row[known]
        vertex = np.stack([self._corner[:, turn] for turn in ([0, 1, 2], [1, 2, 0], [2, 0, 1])]).reshape(3, -1)
        moved = known & (vertex >= 0)
        self._moved = np.nonzero(moved)
        self._entry = row[self._moved[1]] * len(vertices) + vertex[moved]
        self._shape = (len(rows), len(vertices))
        self._vertices, self._t, self._z = vertices, t, placed.z.copy()
        self._weights = sheet.weights[rows] / placed.c
        self._spread = np.abs(self._weights) + sheet.typical / placed.c
        at = placed.z[self._ends]
        self._length = float(np.abs(at[:, 0] - at[:, 1]).mean())

    def cost_of(self, z: NDArray) -> float:
        """The cost that positions leave."""
        self._z[self._vertices] = z
        return float(cost(self._misfit()).sum())

    def improved(self, z: NDArray) -> tuple[NDArray[np.complex128], float]:
        """Positions from a start, and the cost that they leave."""
        self._z[self._vertices] = z
        misfit = self._misfit()
        least, damping = float(cost(misfit).sum()), _DAMPING
        for _ in range(_STEPS):
            before = least
            step = self._step(misfit, damping)
            for factor in (1.0, 0.3):
                self._z[self._vertices] = z + factor * step
                trial = self._misfit()
                after = float(cost(trial).sum())
                if after < least:
                    z, misfit, least = self._z[self._vertices], trial, after
                    break
            if least > _SLOW * before:
                break
            damping = max(damping / 10, _LEAST_DAMPING)
        return z, least

    def conformal(self) -> NDArray[np.complex128]:
        """The linear conformal map: (L z)_a = -i/2 sum (z_next - z_previous) over the triangles at a."""
        moving = self._shape[1]
        own, other, place, value = self._conformal_terms()
        fixed = place < 0
        matrix = np.zeros((moving, moving), dtype=np.complex128)
        np.add.at(matrix, (own[~fixed], place[~fixed]), value[~fixed])
        rhs = np.zeros(moving, dtype=np.complex128)
        np.add.at(rhs, own[fixed], -value[fixed] * self._z[other[fixed]])
        try:
            return np.asarray(np.linalg.solve(matrix, rhs))
        except np.linalg.LinAlgError:
            return self._z[self._vertices]

    def _conformal_terms(self) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Equation, vertex, its place among those that move or -1, and coefficient of each term."""
        terms = []
        for k in (0, 1):
            rows = self._end[:, k] >= 0
            own, w = self._end[rows, k], self._weights[rows]
            terms.append((own, self._ends[rows, k], own, w))
            terms.append((own, self._ends[rows, 1 - k], self._end[rows, 1 - k], -w))
        for k in range(3):
            at = self._corner[:, k] >= 0
            for step, factor in ((1, 0.5j), (2, -0.5j)):
                after = (k + step) % 3
                own = self._corner[at, k]
                terms.append((own, self._t[at, after], self._corner[at, after], np.full(len(own), factor)))
        own, other, place, value = (np.concatenate(part) for part in zip(*terms, strict=True))
        return own, other, place, value

    def _misfit(self) -> NDArray[np.float64]:
        cotangent = Sheet.cotangents(self._z[self._t]).ravel()[self._kept]
        w = np.bincount(self._row, cotangent / 2, self._shape[0])
        return np.asarray((self._weights - w) / self._spread)

    def _step(self, misfit: NDArray, damping: float) -> NDArray[np.complex128]:
        gradient = Sheet.gradients(self._z[self._t]).reshape(3, -1)[self._moved]
        edges, moving = self._shape
        size = edges * moving
        real, imaginary = (
            np.bincount(self._entry, part, size).reshape(edges, moving) for part in (gradient.real, -gradient.imag)
        )
        jacobian = np.hstack([real, imaginary]) / self._spread[:, None]
        weighted = jacobian.T / (cost(misfit) + SMOOTH)
        normal = weighted @ jacobian
        normal[np.diag_indices(2 * moving)] += damping / self._length**2
        try:
            d = np.linalg.solve(normal, weighted @ misfit)
        except np.linalg.LinAlgError:
            return np.zeros(moving, np.complex128)
        step = d[:moving] + 1j * d[moving:]
        longest = float(np.abs(step).max(initial=0.0))
        return np.asarray(step * min(1.0, _LONGEST_STEP * self._length / max(longest, 1e-300)))


def _incidence(row: NDArray, column: NDArray, shape: tuple[int, int]) -> sp.csr_array:
    return sp.csr_array((np.ones(len(row)), (row, column)), shape=shape)


def adjacent_to(matrix: sp.csr_array, rows: NDArray) -> NDArray[np.int64]:
    """Distinct columns of some rows (k,) of an incidence matrix."""
    parts = [matrix.indices[matrix.indptr[k] : matrix.indptr[k + 1]] for k in rows.tolist()]
    return np.unique(np.concatenate(parts)).astype(np.int64) if parts else np.empty(0, np.int64)
