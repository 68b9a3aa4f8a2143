"""Triangles that know the squared lengths of their sides, and nothing of where they lie.

For squared sides u_0, u_1, u_2 of a triangle of area a, and g_k half the cotangent of the angle that faces side k,

    16 a^2 = (u_0 + u_1 + u_2)^2 - 2 (u_0^2 + u_1^2 + u_2^2),
    g_k = (u_0 + u_1 + u_2 - 2 u_k) / 8 a,   da / du_k = g_k / 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import SolverError
from ..linalg import UpperTriangle, factorisation
from ..topology import Piece
from ..topology.surface import Together


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Triangles glued along edges; no orientation or planarity is needed."""

    n: int  # number of vertices
    edges: NDArray[np.int64]  # (e, 2)
    triangles: NDArray[np.int64]  # (m, 3) vertices
    opposite: NDArray[np.int64]  # (m, 3) the edge that faces each corner

    @classmethod
    def of(cls, n: int, edges: NDArray, pieces: Sequence[Piece]) -> Skeleton:
        """Pieces of a graph, in its numbering."""
        union = Together(pieces)
        return cls(n, edges, union.vertices[union.triangles], union.edge_rows[union.opposite])

    @cached_property
    def sides(self) -> NDArray[np.int64]:
        """(e,) number of triangles at each edge."""
        return np.bincount(self.opposite.ravel(), minlength=len(self.edges))

    @cached_property
    def degree(self) -> NDArray[np.int64]:
        """(n,) number of triangles at each vertex."""
        return np.bincount(self.triangles.ravel(), minlength=self.n)

    @cached_property
    def at_edges(self) -> sp.csr_array:
        """(e, m) sums over the triangles of each edge."""
        return self._incidence(self.opposite, len(self.edges))

    @cached_property
    def at_vertices(self) -> sp.csr_array:
        """(n, m) sums over the triangles of each vertex."""
        return self._incidence(self.triangles, self.n)

    def _incidence(self, of: NDArray, count: int) -> sp.csr_array:
        m = len(of)
        return sp.coo_array((np.ones(3 * m), (of.ravel(), np.repeat(np.arange(m), 3))), shape=(count, m)).tocsr()


@dataclass(frozen=True, eq=False)
class Metric:
    """Squared lengths u (e,) of the edges of a skeleton.

    Every triangle has an area: see :meth:`within`.
    """

    skeleton: Skeleton
    u: NDArray[np.float64]

    @cached_property
    def areas(self) -> NDArray[np.float64]:
        """(m,)."""
        u = self.u[self.skeleton.opposite]
        return np.asarray(np.sqrt(u.sum(axis=1) ** 2 - 2 * (u * u).sum(axis=1)) / 4)

    @cached_property
    def halves(self) -> NDArray[np.float64]:
        """(m, 3) half the cotangent of each angle."""
        u = self.u[self.skeleton.opposite]
        return np.asarray((u.sum(axis=1, keepdims=True) - 2 * u) / (8 * self.areas[:, None]))

    @cached_property
    def weights(self) -> NDArray[np.float64]:
        """(e,) those of the Laplacian, w."""
        place, count = self.skeleton.opposite.ravel(), len(self.skeleton.edges)
        return np.asarray(np.bincount(place, self.halves.ravel(), count), dtype=np.float64)

    def derivatives(self) -> tuple[sp.csr_array, sp.csr_array]:
        """(e, e) of the weights and (m, e) of the areas, by the logarithms of u."""
        opposite, m, e = self.skeleton.opposite, len(self.areas), len(self.u)
        u, g = self.u[opposite][:, None, :], self.halves
        signs = np.ones((3, 3)) - 2 * np.eye(3)
        change = u * (signs - 4 * g[:, :, None] * g[:, None, :]) / (8 * self.areas[:, None, None])
        place = np.repeat(opposite, 3, axis=1).ravel(), np.tile(opposite, (1, 3)).ravel()
        weights = sp.coo_array((change.ravel(), place), shape=(e, e)).tocsr()
        place = np.repeat(np.arange(m), 3), opposite.ravel()
        return weights, sp.coo_array(((u[:, 0] * g / 2).ravel(), place), shape=(m, e)).tocsr()

    def within(self, change: NDArray, nearly: float) -> NDArray[np.float64]:
        """(e,) a change of u (e,), less where it would take a triangle's area, which keeps a part of it: 1 - nearly.

        Edges of such triangles change by as much less, but no others: one flat triangle holds up its neighbours only.
        """
        share = np.ones(len(change))
        for _ in range(30):  # of neighbours that a triangle holds up
            part = np.minimum(1.0, nearly * self._farthest(share * change))
            if part.min(initial=1.0) == 1:
                return share * change
            least = np.ones(len(change))
            np.minimum.at(least, self.skeleton.opposite.ravel(), np.repeat(part, 3))
            share *= least
        return share * change * min(1.0, nearly * float(self._farthest(share * change).min(initial=np.inf)))

    def _farthest(self, change: NDArray) -> NDArray[np.float64]:
        """(m,) how far along u + t change (e,) triangles keep an area, and their edges a length: least positive roots.

        The square of each area is a quadratic in t.
        """
        u, d = self.u[self.skeleton.opposite], change[self.skeleton.opposite]
        a = d.sum(axis=1) ** 2 - 2 * (d * d).sum(axis=1)
        b = u.sum(axis=1) * d.sum(axis=1) - 2 * (u * d).sum(axis=1)
        c = u.sum(axis=1) ** 2 - 2 * (u * u).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(b * b - a * c)  # not a number where the area never vanishes
            ends = np.column_stack([c / (root - b), c / (-root - b), -u / d])
        return np.asarray(np.where(ends > 0, ends, np.inf).min(axis=1))


def areas_of_mass(skeleton: Skeleton, entries: NDArray, diagonal: NDArray) -> NDArray[np.float64] | None:
    """(m,) s times the area of each triangle, by least squares; None where they are not determined.

    s M has s a / 12 from every triangle on each of its edges, and s a / 6 at each of its corners.

    `entries` (e,): A_ij; `diagonal` (n,).
    """
    matrix = sp.csr_array(sp.vstack([skeleton.at_edges / 12, skeleton.at_vertices / 6]))
    given = np.concatenate([entries, diagonal])
    if not given.all():  # those of a mass matrix are all positive
        return None
    size = 1 / np.maximum(np.abs(given), np.finfo(float).tiny)  # graded meshes: all to the same number of digits
    weighted = sp.csr_array(sp.diags_array(size) @ matrix)
    unit = 1 / np.sqrt(np.asarray(weighted.multiply(weighted).sum(axis=0)).ravel())
    scaled = sp.csr_array(weighted @ sp.diags_array(unit))
    normal = UpperTriangle.of(sp.csr_array(scaled.T @ scaled))
    factor = factorisation(normal, definite=True)
    areas = np.zeros(len(unit))
    try:
        factor.factorise(normal)
        for _ in range(2):  # the second step takes off the error of normal equations
            areas = areas + unit * factor.solve(scaled.T @ (size * given - weighted @ areas))
    except SolverError:  # the rank is not full to the square root of working accuracy
        return None
    finally:
        factor.release()
    return areas
