"""The least-squares layout: what a reader would use today in place of section 5's embeddings.

Every corner says that one side of its triangle is the other one turned and scaled: linear in the positions.
All corners together are one sparse least-squares problem, with no order of triangles and no accumulated error.

References
----------
Sheffer, Levy, Mogilnitsky, Bogomyakov, "ABF++: fast and robust angle based flattening", ACM TOG 24, 2005.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..topology import Piece


def least_squares_layout(piece: Piece, angles: NDArray) -> NDArray[np.complex128]:
    """(n,) positions that fit angles (3m,) best; two vertices far apart in the graph at 0 and 1.

    Row 3 t + k, for the corner k = u with v and w following it, is
    sin phi_w (z_w - z_u) - sin phi_v e^{i phi_u} (z_v - z_u) = 0; the sines weigh triangles by their size in the
    angles alone, so that thin ones do not rule.
    """
    matrix = corner_equations(piece, angles)
    pinned = _pins(piece)
    free = np.setdiff1d(np.arange(piece.n_vertices), pinned)
    z = np.zeros(piece.n_vertices, dtype=np.complex128)
    z[pinned] = [0, 1]
    rhs = -(matrix @ z)
    columns = sp.csc_matrix(matrix)[:, free]
    normal = sp.csc_matrix(columns.conj().T @ columns)
    solve = spla.splu(normal).solve
    z[free] = solve(columns.conj().T @ rhs)
    # One refinement: normal equations lose half the digits, and this brings most of them back.
    z[free] += solve(columns.conj().T @ (rhs - columns @ z[free]))
    return z


def corner_equations(piece: Piece, angles: NDArray) -> sp.csr_array:
    """The (3m, n) complex matrix of the layout."""
    t, phi = piece.triangles, np.asarray(angles).reshape(-1, 3)
    v, w = np.roll(t, -1, axis=1), np.roll(t, -2, axis=1)
    at_w = np.sin(np.roll(phi, -2, axis=1)).astype(np.complex128)
    at_v = -np.sin(np.roll(phi, -1, axis=1)) * np.exp(1j * phi)
    row = np.tile(np.arange(t.size), 3)
    data = np.concatenate([at_w.ravel(), at_v.ravel(), -(at_w + at_v).ravel()])
    column = np.concatenate([w.ravel(), v.ravel(), t.ravel()])
    return sp.coo_array((data, (row, column)), shape=(t.size, piece.n_vertices)).tocsr()


def _pins(piece: Piece) -> NDArray:
    """Two vertices with many edges between them."""
    i, j = piece.edges.T
    graph = sp.coo_array((np.ones(len(i), np.int8), (i, j)), shape=(piece.n_vertices, piece.n_vertices)).tocsr()
    first = csgraph.breadth_first_order(graph, 0, directed=False, return_predecessors=False)[-1]
    last = csgraph.breadth_first_order(graph, first, directed=False, return_predecessors=False)[-1]
    return np.array([first, last])
