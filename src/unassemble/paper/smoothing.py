"""Coordinate-Smoothing (paper, section 5.1): the law of sines as equations for coordinates."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from ..topology import Piece


def coordinate_smoothing(
    piece: Piece, angles: NDArray, z: NDArray, *, steps: int = 5, damping: float = 1e-6
) -> NDArray[np.complex128]:
    """A few Gauss-Newton steps on |pq|^2 sin^2 = |pr|^2 sin^2, three equations for each triangle.

    All equations hold when every point is in one place: the least-squares problem of the paper has the minimum
    zero at a collapse. Two vertices, far apart in z, are therefore kept where they are. Steps that do not lower the
    residual are shortened, and the iteration ends where that does not help.

    Parameters
    ----------
    piece : Piece
    angles : (3m,) float64
    z : (n,) complex128
        Where to start.
    steps : int
        Most steps.
    damping : float
        Added to the normal matrix, relative to its mean diagonal (Levenberg, Marquardt).
    """
    z = np.asarray(z, dtype=np.complex128).copy()
    free = np.setdiff1d(np.arange(piece.n_vertices), _far_apart(z))
    s2 = np.sin(np.asarray(angles).reshape(-1, 3)) ** 2
    value, jacobian = law_of_sines(piece, s2, z)
    for _ in range(steps):
        j = jacobian[:, np.r_[free, free + len(z)]]
        normal = sp.csc_matrix(j.T @ j)
        normal = normal + damping * normal.diagonal().mean() * sp.identity(normal.shape[0], format="csc")
        step = spla.spsolve(normal, -(j.T @ value))
        z, value, jacobian, better = _shortened(piece, s2, z, free, step, value, jacobian)
        if not better:
            break
    return z


def law_of_sines(piece: Piece, squared_sines: NDArray, z: NDArray) -> tuple[NDArray, sp.csr_array]:
    """Residuals (3m,) and Jacobian (3m, 2n; all x, then all y).

    Row 3 t + k, for the corner k = u with v and w following it, is |uv|^2 sin^2 phi_v - |uw|^2 sin^2 phi_w.
    """
    t, n = piece.triangles, len(z)
    v, w = np.roll(t, -1, axis=1), np.roll(t, -2, axis=1)
    sin_v, sin_w = np.roll(squared_sines, -1, axis=1), np.roll(squared_sines, -2, axis=1)
    to_v, to_w = z[v] - z[t], z[w] - z[t]
    value = np.abs(to_v) ** 2 * sin_v - np.abs(to_w) ** 2 * sin_w
    d_v, d_w = 2 * to_v * sin_v, -2 * to_w * sin_w
    row = np.tile(np.arange(t.size), 3)
    column = np.concatenate([v.ravel(), w.ravel(), t.ravel()])
    slope = np.concatenate([d_v.ravel(), d_w.ravel(), (-d_v - d_w).ravel()])
    parts = (np.r_[slope.real, slope.imag], (np.r_[row, row], np.r_[column, column + n]))
    return value.ravel(), sp.coo_array(parts, shape=(t.size, 2 * n)).tocsr()


def _shortened(
    piece: Piece, s2: NDArray, z: NDArray, free: NDArray, step: NDArray, value: NDArray, jacobian: sp.csr_array
) -> tuple[NDArray, NDArray, sp.csr_array, bool]:
    """Halve the step until the residual falls, twelve times at most."""
    move = step[: len(free)] + 1j * step[len(free) :]
    size = np.linalg.norm(value)
    for halving in range(12):
        new = z.copy()
        new[free] += move / 2**halving
        at_new, slope = law_of_sines(piece, s2, new)
        if np.linalg.norm(at_new) < size:
            return new, at_new, slope, True
    return z, value, jacobian, False


def _far_apart(z: NDArray) -> NDArray:
    """The vertex farthest from the mean, and the vertex farthest from that."""
    first = int(np.argmax(np.abs(z - z.mean())))
    return np.array([first, int(np.argmax(np.abs(z - z[first])))])
