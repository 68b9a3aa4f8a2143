"""BFS-Embedding and Modified BFS-Embedding (paper, section 5).

These two are sequences by nature: where a vertex goes depends on where the queue has put others.
They are written as the paper has them, one triangle after another.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..topology import Piece


def bfs_embedding(piece: Piece, angles: NDArray, *, root: int = 0, averaging: bool = False) -> NDArray[np.complex128]:
    """Positions from angles, triangle by triangle outwards from one of them.

    Parameters
    ----------
    piece : Piece
    angles : (3m,) float64
        In the order of ``piece.triangles.ravel()``.
    root : int
        The first triangle; the edge that faces its last corner becomes (0, 0)-(1, 0).
    averaging : bool
        Modified BFS-Embedding: a vertex already embedded moves to the mean of its old and its new
        place. Otherwise it stays, and the later triangle's angles are silently changed.

    Returns
    -------
    z : (n,) complex128
    """
    order, entering = dual_order(piece, root)
    turn, ratio = _turns(angles)
    z = [0j] * piece.n_vertices
    placed = [False] * piece.n_vertices
    u, v, _ = piece.triangles[root]
    z[v] = 1 + 0j
    placed[u] = placed[v] = True
    corners, triangles = entering.tolist(), piece.triangles.tolist()
    for t in order.tolist():
        k = corners[t]
        i, j, apex = triangles[t][(k + 1) % 3], triangles[t][(k + 2) % 3], triangles[t][k]
        if placed[apex] and not averaging:
            continue
        corner = 3 * t + (k + 1) % 3
        new = z[i] + (z[j] - z[i]) * ratio[3 * t + k] * turn[corner]
        z[apex] = (z[apex] + new) / 2 if placed[apex] else new
        placed[apex] = True
    return np.array(z)


def dual_order(piece: Piece, root: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles in breadth-first order from `root`.

    Returns
    -------
    order : (m,) int64
    entering : (m,) int64
        Position (0, 1, 2) of the corner of each triangle that faces the edge it was entered through; 2 for the root.
    """
    m = len(piece.triangles)
    one, two = piece.facing[piece.facing[:, 1] >= 0].T
    pairs = (np.r_[one // 3, two // 3], np.r_[two // 3, one // 3])
    # An entry (s, t) holds, counted from 1, the corner of t that faces the edge shared with s.
    dual = sp.coo_array((np.r_[two % 3, one % 3] + 1, pairs), shape=(m, m)).tocsr()
    order, parent = csgraph.breadth_first_order(dual, root, directed=True)
    entering = np.full(m, 2, dtype=np.int64)
    rest = order[1:]
    entering[rest] = np.asarray(dual[parent[rest], rest]).ravel() - 1
    return order.astype(np.int64), entering


def _turns(angles: NDArray) -> tuple[list[complex], list[float]]:
    """e^{i phi} of every corner, and |i apex| / |i j| = sin phi_j / sin phi_apex of every apex."""
    phi = np.asarray(angles, dtype=np.float64).reshape(-1, 3)
    sines = np.sin(phi)
    ratio = np.roll(sines, -2, axis=1) / sines  # at the corner two places on from the apex stands j
    return np.exp(1j * phi).ravel().tolist(), ratio.ravel().tolist()
