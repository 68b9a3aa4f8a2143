"""Starting guesses for the angles (paper, section 3.4)."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from ..errors import GeometryError, InputError
from ..topology import Piece

STARTS = ("equal", "barycentric", "weighted")


def start_angles(
    piece: Piece, weights: NDArray, kind: str, *, loop: int | None = None, least: float = 1e-3
) -> NDArray[np.float64]:
    """(3m,) angles to start from.

    Parameters
    ----------
    piece : Piece
    weights : (e,) float64
        -A_ij; only the weighted guess uses them.
    kind : {"equal", "barycentric", "weighted"}
        pi/3 everywhere, or the angles of a barycentric embedding.
    loop : int, optional
        The boundary loop that is laid on the polygon; the longest by default.
    least : float
        Angles are kept in [least, pi - least], radians: a barycentric embedding may have flat triangles.
    """
    if kind == "equal":
        return np.full(piece.triangles.size, np.pi / 3)
    if kind not in STARTS:
        raise InputError(f"there is no starting guess {kind!r}; the choices are {', '.join(STARTS)}")
    springs = np.ones(len(piece.edges)) if kind == "barycentric" else np.abs(weights)
    z = barycentric_embedding(piece, springs, loop=loop)
    return np.clip(angles_of(z, piece.triangles), least, np.pi - least).ravel()


def barycentric_embedding(piece: Piece, springs: NDArray, *, loop: int | None = None) -> NDArray[np.complex128]:
    """Every vertex but those of one boundary loop at the weighted mean of its neighbours (Tutte, reference [13]).

    The loop is a regular polygon on the unit circle, run through counter-clockwise. Vertices of other loops are
    free like the interior ones.

    Parameters
    ----------
    piece : Piece
    springs : (e,) float64, >= 0
        Ones for Tutte's embedding, |A_ij| for the weighted one. With a vanished entry the edge is not there: the
        embedding is that of the graph without it, and has no solution where that cuts a vertex off.

    Raises
    ------
    GeometryError
        Where the springs do not hold a vertex.
    """
    rim = _loop(piece, loop)
    z = np.zeros(piece.n_vertices, dtype=np.complex128)
    z[rim] = np.exp(2j * np.pi * np.arange(len(rim)) / len(rim))
    free = np.setdiff1d(np.arange(piece.n_vertices), rim)
    if not len(free):
        return z
    matrix = graph_laplacian(piece, springs)
    if (matrix.diagonal()[free] <= 0).any():
        at = piece.vertices[free[np.argmin(matrix.diagonal()[free])]]
        raise GeometryError(f"all entries of row {at} are zero: a weighted barycentric start cannot place it")
    rows = matrix[free]
    pulled = rows[:, rim] @ np.column_stack([z[rim].real, z[rim].imag])
    with np.errstate(all="ignore"):
        placed = spla.splu(sp.csc_matrix(rows[:, free])).solve(-pulled)
    if not np.isfinite(placed).all():
        raise GeometryError("the nonzero entries leave vertices unconnected: take the plain barycentric start")
    z[free] = placed @ [1, 1j]
    return z


def angles_of(z: NDArray, triangles: NDArray) -> NDArray[np.float64]:
    """(m, 3) angles in [0, pi] of triangles (m, 3) with corners at z (n,) complex, whichever way they turn."""
    p = z[triangles]
    ahead, behind = np.roll(p, -1, axis=1) - p, np.roll(p, -2, axis=1) - p
    return np.abs(np.angle(behind * ahead.conj()))


def graph_laplacian(piece: Piece, springs: NDArray) -> sp.csr_array:
    """Sum of springs on the diagonal, minus the spring off it, (n, n)."""
    (i, j), n = piece.edges.T, piece.n_vertices
    off = sp.coo_array((np.r_[springs, springs], (np.r_[i, j], np.r_[j, i])), shape=(n, n)).tocsr()
    return sp.csr_array(sp.diags_array(off.sum(axis=1)) - off)


def _loop(piece: Piece, loop: int | None) -> NDArray:
    if loop is None:
        return piece.longest_loop
    if not 0 <= loop < piece.n_loops:
        raise InputError(f"there is no boundary loop {loop}; the piece has {piece.n_loops}, numbered from 0")
    return piece.boundary[piece.loop_offsets[loop] : piece.loop_offsets[loop + 1], 0]
