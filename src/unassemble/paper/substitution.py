"""Substituting the interior into the tube's equations (paper, section 6, second approach).

The unknowns are the positions of the boundary alone. Equation (6) gives the interior as H z_B with the dense (w, n_B)
matrix H = -A_I^{-1} A_IB, and the tube's edge equations (1)-(2), written in coordinates, are solved by Gauss-Newton.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..topology import Piece
from .harmonic import HarmonicReduction, tube_triangles


@dataclass(frozen=True, eq=False)
class SubstitutionResult:
    """Result of :func:`substitution`.

    Attributes
    ----------
    z : (n,) complex128
    residuals : (k + 1,) float64
        Norm of the tube's edge equations.
    converged : bool
    status : str
    stored : int
        Numbers in H, which stay for the whole iteration.
    jacobian_entries : int
        Entries of the tube's Jacobian with respect to the boundary, which is dense.
    """

    z: NDArray[np.complex128]
    residuals: NDArray[np.float64]
    converged: bool
    status: str
    stored: int
    jacobian_entries: int


def substitution(
    piece: Piece, weights: NDArray, boundary_values: NDArray, *, tolerance: float = 1e-10, max_steps: int = 50
) -> SubstitutionResult:
    """Gauss-Newton for the boundary positions, steps halved until the residual falls.

    Parameters
    ----------
    piece : Piece
        Holes are no hindrance here: H couples all boundaries.
    weights : (e,) float64
        w_ij; the scale must be known.
    boundary_values : (n_B,) complex128
        First guess at the boundary vertices, in increasing order.
    """
    harmonic = HarmonicReduction(piece, weights)
    spread = np.zeros((piece.n_vertices, len(harmonic.boundary)))
    spread[harmonic.boundary] = np.eye(len(harmonic.boundary))
    spread[harmonic.interior] = harmonic.operator()
    rows = _tube_edges(piece)
    z_b = np.asarray(boundary_values, dtype=np.complex128)
    value, jacobian = _equations(piece, weights, rows, spread, z_b)
    residuals = [float(np.linalg.norm(value))]
    while residuals[-1] > tolerance and len(residuals) <= max_steps:
        step = np.linalg.lstsq(jacobian, -value, rcond=1e-10)[0]
        move = step[: len(z_b)] + 1j * step[len(z_b) :]
        for halving in range(20):
            candidate = _equations(piece, weights, rows, spread, z_b + move / 2**halving)
            if np.linalg.norm(candidate[0]) < residuals[-1]:
                break
        else:
            break
        z_b, (value, jacobian) = z_b + move / 2**halving, candidate
        residuals.append(float(np.linalg.norm(value)))
    converged = residuals[-1] <= tolerance
    verb = "converged" if converged else "stopped"
    status = f"{verb}: the tube's equations are at {residuals[-1]:.1e} after {len(residuals) - 1} steps"
    stored = len(harmonic.interior) * len(harmonic.boundary)
    return SubstitutionResult(spread @ z_b, np.array(residuals), converged, status, stored, jacobian.size)


def _tube_edges(piece: Piece) -> NDArray:
    """Edges with all their elements in the tube, whose equations need no angle from inside."""
    tube = tube_triangles(piece)
    one, two = piece.facing.T
    return np.flatnonzero(tube[one // 3] & ((two < 0) | tube[two // 3]))


def _equations(piece: Piece, weights: NDArray, rows: NDArray, spread: NDArray, z_b: NDArray) -> tuple[NDArray, NDArray]:
    """Residual and dense Jacobian (all x, then all y) of the edge equations `rows` in the boundary positions."""
    z = spread @ z_b
    cotangent, slope = cotangents_of(piece, z)
    value = np.bincount(piece.opposite.ravel(), cotangent, len(piece.edges)) - 2 * weights
    corner = np.arange(piece.triangles.size)
    shape = (len(piece.edges), corner.size)
    add = sp.csr_array(sp.coo_array((np.ones(corner.size), (piece.opposite.ravel(), corner)), shape=shape))[rows]
    by_x, by_y = (np.asarray((add @ part) @ spread) for part in slope)
    return value[rows], np.hstack([by_x, by_y])


def cotangents_of(piece: Piece, z: NDArray) -> tuple[NDArray, tuple[sp.csr_array, sp.csr_array]]:
    """Cotangents (3m,) of the corners of z, and their derivatives by x and by y, (3m, n) each."""
    t = piece.triangles
    v, w = np.roll(t, -1, axis=1).ravel(), np.roll(t, -2, axis=1).ravel()
    u = t.ravel()
    a, b = z[v] - z[u], z[w] - z[u]
    dot, cross = (a.conj() * b).real, (a.conj() * b).imag
    cotangent = dot / cross
    # With gradients as complex numbers: of a . b they are b and a, of a x b they are -ib and ia.
    by_a = (b + 1j * cotangent * b) / cross
    by_b = (a - 1j * cotangent * a) / cross
    row = np.tile(np.arange(u.size), 3)
    data, column = np.concatenate([by_a, by_b, -by_a - by_b]), np.concatenate([v, w, u])
    shape = (u.size, len(z))
    return cotangent, (
        sp.csr_array(sp.coo_array((data.real, (row, column)), shape=shape)),
        sp.csr_array(sp.coo_array((data.imag, (row, column)), shape=shape)),
    )
