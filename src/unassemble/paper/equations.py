"""The angle equations (1) to (4) of section 2.1, with the additions of section 7 and of later readers.

For the given weights w_ij = -A_ij and the paper's factor c,

    (3)      phi_1 + phi_2 + phi_3 - pi           = 0      for every triangle,
    (4)      sum of the angles about v - 2 pi     = 0      for every interior vertex,
    (1)-(2)  cot phi + cot phi' - 2 c w_ij        = 0      for every edge; one angle on the boundary,

in this order of rows (section 3.1). The paper's c multiplies the matrix: it is the *inverse* of
the c in A = cL + D. Options add one equation for every boundary loop (sum of the interior angles of a
polygon; these mend the rank where there are holes), and the product of sines about
every interior vertex (paper's references [5, 10]), as a sum of logarithms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .corners import Corners, following_corner
from .jacobian import AngleJacobian

Unknowns = Literal["cotangents", "angles"]


@dataclass(frozen=True, eq=False)
class AngleSystem:
    """F(x) = 0 for x the cotangents or the angles of a piece, and c after them where it is unknown.

    Attributes
    ----------
    corners : Corners
    weights : (e,) float64
        -A_ij of each edge.
    unknowns : {"cotangents", "angles"}
        The paper's choice is the first: cotangents are unbounded.
    scale_free : bool
        Whether c is one more unknown (section 7); otherwise it is 1.
    outer : int or None
        The outer boundary loop; where given, one equation for every loop is added: its interior
        angles sum to (k - 2) pi outside and to (k + 2) pi around a hole, for k edges.
    sines : bool
        Add the products of sines about interior vertices.
    """

    corners: Corners
    weights: NDArray[np.float64]
    unknowns: Unknowns = "cotangents"
    scale_free: bool = False
    outer: int | None = None
    sines: bool = False

    @property
    def n_unknowns(self) -> int:
        """3 m, and one more with c."""
        return self.corners.edge.size + int(self.scale_free)

    @property
    def row_of_interior(self) -> int:
        """First row of (4)."""
        return self.corners.counts.m

    @property
    def row_of_edges(self) -> int:
        """First row of (1)-(2)."""
        return self.corners.counts.m + self.corners.w

    @property
    def row_of_loops(self) -> int:
        """First row after (1)-(4)."""
        return self.corners.counts.equations

    @property
    def row_of_sines(self) -> int:
        """First row of the sine products."""
        return self.row_of_loops + (0 if self.outer is None else len(self.corners.loop_lengths))

    @property
    def n_equations(self) -> int:
        """e + m + w, and what the options add."""
        return self.row_of_sines + (self.corners.w if self.sines else 0)

    def split(self, rows: NDArray) -> tuple[NDArray, ...]:
        """Rows of (3), (4), (1)-(2), loops, sines; the last two may be empty."""
        cuts = (self.row_of_interior, self.row_of_edges, self.row_of_loops, self.row_of_sines)
        return tuple(np.split(rows, cuts))

    def pack(self, angles: NDArray, c: float = 1.0) -> NDArray:
        """The unknowns for given angles (3m,) and c."""
        flat = np.asarray(angles, dtype=np.float64).ravel()
        x = 1 / np.tan(flat) if self.unknowns == "cotangents" else flat
        return np.append(x, c) if self.scale_free else x.copy()

    def angles(self, x: NDArray) -> NDArray:
        """(3m,) angles of the unknowns; from cotangents always in (0, pi), condition (8)."""
        corners = x[: self.corners.edge.size]
        return np.arctan2(1.0, corners) if self.unknowns == "cotangents" else corners

    def factor(self, x: NDArray) -> float:
        """The paper's c."""
        return float(x[-1]) if self.scale_free else 1.0

    def residual(self, x: NDArray) -> NDArray:
        """F(x), (equations,)."""
        angles = self.angles(x)
        cotangents = x[: angles.size] if self.unknowns == "cotangents" else 1 / np.tan(angles)
        blocks = [
            self.sum_over_triangles(angles) - np.pi,
            self.sum_over_interior(angles) - 2 * np.pi,
            self.sum_over_edges(cotangents) - 2 * self.factor(x) * self.weights,
        ]
        if self.outer is not None:
            blocks.append(self.sum_over_loops(angles) - self._loop_sums())
        if self.sines:
            blocks.append(self.sum_of_sine_terms(np.log(np.sin(angles))))
        return np.concatenate(blocks)

    def jacobian(self, x: NDArray) -> AngleJacobian:
        """J(x), matrix-free."""
        angles = self.angles(x)
        derivative = -(np.sin(angles) ** 2) if self.unknowns == "cotangents" else -1 / np.sin(angles) ** 2
        return AngleJacobian(self, derivative, 1 / np.tan(angles) if self.sines else None)

    def advance(self, x: NDArray, step: NDArray, *, reach: float = 0.9) -> tuple[NDArray, float]:
        """x + t s with the greatest t <= 1 that keeps (8): no angle goes more than `reach` of its way to 0 or pi.

        Cotangents are free, and t = 1. Returns the new x and t.
        """
        if self.unknowns == "cotangents":
            return x + step, 1.0
        n = self.corners.edge.size
        room = np.where(step[:n] < 0, x[:n], np.pi - x[:n])
        with np.errstate(divide="ignore"):
            t = float(min(1.0, reach * np.min(room / np.abs(step[:n]))))
        return x + t * step, t

    def sum_over_triangles(self, values: NDArray) -> NDArray:
        """(m,) sums of corner values (3m,), as in (3)."""
        return values[0::3] + values[1::3] + values[2::3]

    def sum_over_interior(self, values: NDArray) -> NDArray:
        """(w,) sums about interior vertices, as in (4)."""
        corners = self.corners
        return np.bincount(corners.fan, values, len(corners.fan_vertex))[: corners.w]

    def sum_over_edges(self, values: NDArray) -> NDArray:
        """(e,) sums over the one or two corners that face an edge, as in (1)-(2)."""
        facing = self.corners.facing
        padded = np.append(values, 0.0)
        return padded[facing[:, 0]] + padded[facing[:, 1]]

    def sum_over_loops(self, values: NDArray) -> NDArray:
        """(loops,) sums over the corners at the vertices of each boundary loop."""
        corners = self.corners
        fans = np.bincount(corners.fan, values, len(corners.fan_vertex))[corners.w :]
        return np.bincount(corners.fan_loop[corners.w :], fans, len(corners.loop_lengths))

    def sum_of_sine_terms(self, values: NDArray) -> NDArray:
        """(w,) about each interior vertex: value at the next corner less value at the one after it."""
        corner = np.arange(values.size)
        return self.sum_over_interior(values[following_corner(1, corner)] - values[following_corner(2, corner)])

    def spread_sine_terms(self, rows: NDArray) -> NDArray:
        """Transpose of :meth:`sum_of_sine_terms`: (w,) to (3m,)."""
        corners = self.corners
        fans = np.zeros(len(corners.fan_vertex))
        fans[: corners.w] = rows
        at = fans[corners.fan]
        corner = np.arange(at.size)
        return at[following_corner(2, corner)] - at[following_corner(1, corner)]

    def _loop_sums(self) -> NDArray:
        """(loops,) what the interior angles of each boundary polygon add up to."""
        lengths = self.corners.loop_lengths
        turns = np.full(len(lengths), 2.0)
        turns[self.outer] = -2.0
        return (lengths + turns) * np.pi
