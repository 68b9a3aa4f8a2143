"""Reducing the problem onto the boundary (paper, section 2.4): equations (5) and (6), and the tube."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from ..topology import Piece
from .starts import graph_laplacian


class HarmonicReduction:
    """Equation (6): interior positions from those of the boundary, z_I = -A_I^{-1} A_IB z_B.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij. The diagonal of A is minus the sum of its row.

    Attributes
    ----------
    interior, boundary : (w,) int64, (n_B,) int64
        Vertices.
    """

    def __init__(self, piece: Piece, weights: NDArray):
        self.boundary = np.unique(piece.boundary)
        self.interior = np.setdiff1d(np.arange(piece.n_vertices), self.boundary)
        self._matrix = graph_laplacian(piece, weights)
        rows = self._matrix[self.interior]
        self._coupling = rows[:, self.boundary]
        self._factor = spla.splu(sp.csc_matrix(rows[:, self.interior])) if len(self.interior) else None

    def extend(self, boundary_values: NDArray) -> NDArray:
        """(n,) or (n, k) values everywhere from real or complex values (n_B,) or (n_B, k) on the boundary."""
        shape = (self._matrix.shape[0], *boundary_values.shape[1:])
        values = np.zeros(shape, dtype=boundary_values.dtype)
        values[self.boundary] = boundary_values
        if len(self.interior):
            values[self.interior] = self._solve(-(self._coupling @ boundary_values))
        return values

    def operator(self) -> NDArray[np.float64]:
        """-A_I^{-1} A_IB as the dense (w, n_B) array that substitution into the angle equations would need."""
        return np.asarray(self._solve(-self._coupling.toarray()))

    def boundary_load(self, values: NDArray) -> NDArray:
        """(5): b = A_BI x_I + A_B x_B on the boundary, for values (n,).

        For the coordinates of the mesh it is known in advance: b_x is half the difference of y, and b_y minus half
        that of x, between the next and the previous vertex of the boundary. The paper leaves b unknown.
        """
        return (self._matrix @ values)[self.boundary]

    def _solve(self, rhs: NDArray) -> NDArray:
        if self._factor is None:
            return np.zeros((0, *rhs.shape[1:]), dtype=rhs.dtype)
        if np.iscomplexobj(rhs):
            return self._factor.solve(rhs.real.copy()) + 1j * self._factor.solve(rhs.imag.copy())
        return self._factor.solve(rhs)


def tube_triangles(piece: Piece) -> NDArray[np.bool_]:
    """(m,) elements with at least one boundary vertex: the tube."""
    on_boundary = np.zeros(piece.n_vertices, dtype=bool)
    on_boundary[piece.boundary] = True
    touching: NDArray[np.bool_] = np.any(on_boundary[piece.triangles], axis=1)
    return touching
