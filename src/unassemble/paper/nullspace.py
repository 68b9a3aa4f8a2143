"""The null space of the Jacobian at the solution, in closed form (what section 3.2 leaves open).

Theorem. At the exact angles of a mesh the null vectors of (1)-(4) are

    d phi = (s_a - s_b) / R^2        at the corner v of every triangle (v, a, b) of circumradius R,

for the functions s on the vertices that are constant on every boundary loop and satisfy, with g = 1 / R^2,

    sum over the neighbours k of v of  (g_left - g_right) s_k = 0        at every interior vertex v,

left and right of the edge v -> k; constant s give zero. `spiral_matrix` is the matrix K of these
equations, with each loop drawn together to one node. It is antisymmetric and K 1 = 0. So its rank is even,
and the deficiency of J is w + h - rank of the interior rows of K: w where all circumradii are equal, and
for a generic mesh h, but 1 for h = 0 and odd w. With one equation for each loop all rows of K count: the
deficiency is then w + h - rank K, generically 0 or 1 as w + h is even or odd. With the products of sines s satisfies
moreover div (g grad s) = 0 at interior vertices, which leaves at most h dimensions, and none without holes.
The proofs stand in docs/paper.md.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..topology import Piece
from .corners import Corners


def inverse_squared_radii(piece: Piece, z: NDArray) -> NDArray[np.float64]:
    """(m,) 1 / R^2 of every triangle, R its circumradius, from positions z (n,) complex."""
    p = z[piece.triangles]
    a, b, c = (np.abs(p[:, i] - p[:, j]) for i, j in ((1, 2), (2, 0), (0, 1)))
    area = 0.5 * np.abs(((p[:, 1] - p[:, 0]).conj() * (p[:, 2] - p[:, 0])).imag)
    return (4 * area / (a * b * c)) ** 2


def nodes(corners: Corners) -> NDArray[np.int64]:
    """(3m,) node of every corner: interior vertices 0 to w - 1, then the boundary loops."""
    loop = corners.fan_loop[corners.fan]
    return np.where(loop < 0, corners.fan, corners.w + loop)


def spiral_matrix(piece: Piece, corners: Corners, z: NDArray) -> sp.csr_array:
    """K, (w + loops, w + loops), antisymmetric: rows of interior vertices first, then one for each loop."""
    at = nodes(corners).reshape(-1, 3)
    g = np.repeat(inverse_squared_radii(piece, z), 3)
    v, a, b = at.ravel(), np.roll(at, -1, axis=1).ravel(), np.roll(at, -2, axis=1).ravel()
    size = corners.w + len(corners.loop_lengths)
    parts = (np.r_[g, -g], (np.r_[v, v], np.r_[a, b]))
    matrix = sp.coo_array(parts, shape=(size, size)).tocsr()
    matrix.sum_duplicates()
    return matrix


def null_vector(piece: Piece, corners: Corners, z: NDArray, s: NDArray) -> NDArray[np.float64]:
    """(3m,) changes of the angles for s (w + loops,): in the null space of (1)-(3), and of (4) where K s = 0."""
    at = s[nodes(corners)].reshape(-1, 3)
    return ((np.roll(at, -1, axis=1) - np.roll(at, -2, axis=1)) * inverse_squared_radii(piece, z)[:, None]).ravel()


def deficiency(piece: Piece, corners: Corners, z: NDArray, *, loops: bool = False) -> int:
    """Unknowns less rank of the Jacobian at the solution, from K alone; dense, for meshes of a few hundred vertices."""
    matrix = spiral_matrix(piece, corners, z).toarray()
    scale = np.abs(inverse_squared_radii(piece, z)).max()
    rows = matrix if loops else matrix[: corners.w]
    rank = int((np.linalg.svd(rows, compute_uv=False) > 1e-10 * scale).sum()) if rows.size else 0
    return corners.w + len(corners.loop_lengths) - 1 - rank
