"""The conformal pencil of a piece: half the Dirichlet energy against the signed area.

For a map z = x + iy of the mesh into the plane, E(z) = z* L z / 2 is its Dirichlet energy and
a(z) = z* T z its signed area, with T_ab = 1/(4i), T_ba = -1/(4i) for each boundary edge a -> b that
has the mesh on its left. For A = c L + D the matrix c L is known (its rows sum to zero), and

    M(s) = c L / 2 - s T

is positive semidefinite for 0 <= s <= c; M(c) z = 0 exactly for similarities of the true mesh.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..linalg import UpperTriangle, upper_from_edges
from ..topology.keys import contains, pair_keys


class ConformalPencil:
    """M(s) with the last vertex pinned at zero, which removes the constants from its null space.

    Of n vertices; `edges` (e, 2): pairs i < j in lexicographic order; `boundary` (b, 2): directed edges with the mesh
    on their left; `weights` (e,): c w = -A_ij of each edge; `strength` (b,): factors of the boundary edges, such that
    those that enter a vertex add up to those that leave it; 1 by default.
    """

    def __init__(self, n: int, edges: NDArray, boundary: NDArray, weights: NDArray, strength: NDArray | None = None):
        self.n = n
        self._strength = np.ones(len(boundary)) if strength is None else strength
        self.tail, self.head = boundary.T
        # An edge without weight has no entries, unless it lies on the boundary: diagonals of undivided cells.
        used = weights != 0
        if not used.all():
            used |= contains(np.sort(pair_keys(n, *boundary.T)), pair_keys(n, *edges.T))
        edges, weights = edges[used], weights[used]
        self._low, self._high = (np.ascontiguousarray(end) for end in edges.T)
        self._half_weights = weights / 2
        diagonal = np.bincount(edges.ravel(), np.repeat(weights, 2), self.n)
        kept = edges[:, 1] < self.n - 1  # the pinned vertex is the higher end of all its edges
        edges = edges[kept]
        self._energy = upper_from_edges(self.n - 1, edges, -weights[kept] / 2, diagonal[:-1] / 2)
        self._place, self._sign = self._boundary_entries(edges)

    def _boundary_entries(self, edges: NDArray) -> tuple[NDArray, NDArray]:
        """Places of the boundary edges in the upper triangle, and the sign of T there (times -i/4)."""
        inside = (self.tail < self.n - 1) & (self.head < self.n - 1)
        low = np.minimum(self.tail, self.head)[inside]
        high = np.maximum(self.tail, self.head)[inside]
        key = edges[:, 0] * self.n + edges[:, 1]
        # Row i of the triangle starts with its diagonal: i + 1 of those come before an entry of row i.
        place = np.searchsorted(key, low * self.n + high) + low + 1
        return place, self._strength[inside] * np.where(self.tail[inside] < self.head[inside], 1.0, -1.0)

    def matrix(self, shift: float) -> UpperTriangle:
        """M(shift) without the pinned row and column."""
        data = self._energy.data.astype(np.complex128)
        data[self._place] += 0.25j * shift * self._sign
        return self._energy.with_data(data)

    def energy_form(self, z: NDArray) -> NDArray:
        """c L z / 2 for z (n,) complex.

        From differences along edges: its error is rounding relative to an edge's length, not to the mesh's extent.
        """
        flow = self._half_weights * (z[self._low] - z[self._high])
        parts = [np.bincount(self._low, f, self.n) - np.bincount(self._high, f, self.n) for f in (flow.real, flow.imag)]
        return parts[0] + 1j * parts[1]

    def area_form(self, z: NDArray) -> NDArray:
        """T z for z (n,) complex."""
        forward = np.zeros(self.n, dtype=np.complex128)
        # As many boundary edges enter a vertex as leave it, so that differences give the same sum.
        side = -0.25j * self._strength * (z[self.head] - z[self.tail])
        # Each vertex of a boundary that touches itself occurs more than once: accumulate.
        np.add.at(forward, self.tail, side)
        np.add.at(forward, self.head, side)
        return forward
