"""The Jacobian of the angle equations, never formed (paper, section 3.1 and Figure 3).

Of its at most 9 m entries all but 3 m numbers are ones in known places: with cotangents for
unknowns the edge rows are, with angles the triangle and vertex rows. Only d phi / d cot, or
d cot / d phi, is stored, one number for each corner. (Section 3.1 has the words 'linear in angles' and
'linear in cotangents' exchanged: (1)-(2) are linear in the cotangents, (3)-(4) in the angles.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .corners import following_corner

if TYPE_CHECKING:
    from .equations import AngleSystem


@dataclass(frozen=True, eq=False)
class AngleJacobian:
    """J at one point, as two products.

    Attributes
    ----------
    system : AngleSystem
    derivative : (3m,) float64
        d phi / d cot = -1 / (1 + cot^2), or d cot / d phi = -1 / sin^2, of each corner.
    cotangents : (3m,) float64 or None
        Needed for the rows of the sine products only.
    """

    system: AngleSystem
    derivative: NDArray[np.float64]
    cotangents: NDArray[np.float64] | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """Equations, unknowns."""
        return self.system.n_equations, self.system.n_unknowns

    @property
    def stored(self) -> int:
        """Floating point numbers kept for J, the unit entries and the matrix's own weights not counted."""
        return self.derivative.size + (0 if self.cotangents is None else self.cotangents.size)

    def forward(self, step: NDArray) -> NDArray:
        """J s for a step s (unknowns,), in the row order (3), (4), (1)-(2), options."""
        system = self.system
        corners = step[: self.derivative.size]
        if system.unknowns == "cotangents":
            of_angle, of_cotangent = self.derivative * corners, corners
        else:
            of_angle, of_cotangent = corners, self.derivative * corners
        edges = system.sum_over_edges(of_cotangent)
        if system.scale_free:
            edges -= 2 * step[-1] * system.weights
        blocks = [system.sum_over_triangles(of_angle), system.sum_over_interior(of_angle), edges]
        if system.outer is not None:
            blocks.append(system.sum_over_loops(of_angle))
        if self.cotangents is not None:
            blocks.append(system.sum_of_sine_terms(self.cotangents * of_angle))
        return np.concatenate(blocks)

    def adjoint(self, residual: NDArray) -> NDArray:
        """J^T r for r (equations,); every angle gathers from at most three rows of (1)-(4)."""
        system, corners = self.system, self.system.corners
        triangles, interior, edges, loops, sines = system.split(residual)
        fans = np.zeros(len(corners.fan_vertex))
        fans[: corners.w] = interior
        if system.outer is not None:
            fans[corners.w :] = loops[corners.fan_loop[corners.w :]]
        to_angle = fans[corners.fan] + np.repeat(triangles, 3)
        if self.cotangents is not None:
            to_angle += self.cotangents * system.spread_sine_terms(sines)
        to_cotangent = edges[corners.edge]
        if system.unknowns == "cotangents":
            gathered = self.derivative * to_angle + to_cotangent
        else:
            gathered = to_angle + self.derivative * to_cotangent
        if system.scale_free:
            return np.append(gathered, -2 * (system.weights @ edges))
        return gathered

    def sparse(self) -> sp.csr_array:
        """J with all its entries, for pictures, ranks and tests; no solver of this room needs it."""
        system, corners = self.system, self.system.corners
        n = self.derivative.size
        column, ones = np.arange(n), np.ones(n)
        interior = corners.fan < corners.w
        to_angle, to_cotangent = (self.derivative, ones) if system.unknowns == "cotangents" else (ones, self.derivative)
        rows = [column // 3, system.row_of_interior + corners.fan[interior], system.row_of_edges + corners.edge]
        columns = [column, column[interior], column]
        data = [to_angle, to_angle[interior], to_cotangent]
        if system.scale_free:
            rows.append(system.row_of_edges + np.arange(len(system.weights)))
            columns.append(np.full(len(system.weights), n))
            data.append(-2 * system.weights)
        if system.outer is not None:
            rows.append(system.row_of_loops + corners.fan_loop[corners.fan[~interior]])
            columns.append(column[~interior])
            data.append(to_angle[~interior])
        if self.cotangents is not None:
            for turn, sign in ((1, 1.0), (2, -1.0)):
                at = following_corner(turn, column[interior])
                rows.append(system.row_of_sines + corners.fan[interior])
                columns.append(at)
                data.append(sign * (self.cotangents * to_angle)[at])
        parts = (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns)))
        return sp.coo_array(parts, shape=self.shape).tocsr()
