"""Edge lengths from cotangent weights: a convex program, followed along its central path, and Newton's method.

By Heron's formula the area S_t of a triangle is a concave function of its squared side lengths u, homogeneous of degree
one, and its derivative by a side is a quarter of the cotangent of the angle facing it. So weights of edges, half the
sum of the cotangents facing them, are the gradient of twice the sum of all areas, and the metric with given weights c w
solves, uniquely but for its size (Gu, Guo, Luo, Zeng 2010),

    maximise  sum_t S_t(u)   subject to   w . u = 1 ,

with every triangle in the cone S_t(u) >= 0. Nothing is assumed of the surface.

A slack for each area and the logarithmic barrier of the second-order cone, max over s of s + mu log(S^2 - s^2), give
phi(S) = sqrt(mu^2 + S^2) + mu log(sqrt(mu^2 + S^2) - mu), up to a constant: the central path maximises the sum of these
while mu goes to 0. Its Newton steps have one unknown for each edge, and the matrix couples edges of one triangle only.

References
----------
Gu, Guo, Luo, Zeng, "Discrete Laplace-Beltrami operator determines discrete Riemannian metric", arXiv:1010.4070, 2010.
Boyd, Vandenberghe, "Convex Optimization", Cambridge 2004, chapter 11.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import GeometryError, SolverError
from ..linalg import Factorisation, UpperTriangle, factorisation
from .heron import areas_cotangents, blocks_of, heron, longest_step, summed

_STEPS = 120  # in all, before the method gives up; hard meshes take some thirty
_NONE = "no edge lengths were found that have these entries: the triangles that come nearest have no area"


@dataclass(frozen=True, eq=False)
class Metric:
    """Squared edge lengths of one edge-connected piece."""

    squared: NDArray[np.float64]  # (e,) in the gauge of mean 1
    scale: float  # the factor c of the weights


class Normal:
    """Sparse symmetric matrices (e, e) that add up 3 x 3 blocks of triangles; one pattern, analysed once."""

    def __init__(self, opposite: NDArray, size: int):
        row, column = np.repeat(opposite, 3, axis=1).ravel(), np.tile(opposite, (1, 3)).ravel()
        self._above = np.flatnonzero(row <= column)
        key, self._place = np.unique(row[self._above] * size + column[self._above], return_inverse=True)
        self._indices = (key % size).astype(np.int32)
        self._start = np.searchsorted(key // size, np.arange(size + 1)).astype(np.int32)
        self._factor: Factorisation | None = None

    def factorised(self, blocks: NDArray, shift: float = 0.0) -> Factorisation:
        """The factor of the sum of `blocks` (m, 3, 3), its diagonal multiplied by 1 + `shift`."""
        data: NDArray = np.bincount(self._place, blocks.ravel()[self._above], len(self._indices))
        data[self._start[:-1]] *= 1 + shift
        matrix = UpperTriangle(data, self._indices, self._start)
        if self._factor is None:
            self._factor = factorisation(matrix, definite=True)
        self._factor.factorise(matrix)
        return self._factor


def solve_metric(weights: NDArray, opposite: NDArray, *, polish: bool = True) -> Metric:
    """Edge lengths of an edge-connected surface with `weights` (e,), c w for an unknown c > 0.

    `opposite` (m, 3): the edge that faces each corner; `polish`: go on with Newton's method to the level of rounding.

    Raises GeometryError if the program has no solution inside the cone.
    """
    unit = weights / np.abs(weights).max()
    if not np.isfinite(unit).all():
        raise GeometryError("all entries of a piece vanish")
    normal = Normal(opposite, len(weights))
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused
            u, count = _central_path(unit, opposite, normal)
            if polish:
                u = _newton(unit, opposite, normal, u, _STEPS - count)
    except SolverError as error:
        raise GeometryError(_NONE) from error
    _, cotangents = areas_cotangents(u[opposite])
    return Metric(u / u.mean(), float((weights @ u) / (summed(opposite, cotangents / 2, len(u)) @ u)))


def _central_path(w: NDArray, opposite: NDArray, normal: Normal) -> tuple[NDArray, int]:
    """From equilateral triangles to lengths right to about the last barrier, and the number of steps.

    The barrier is relative to the triangle's area at the last centre, so that grading by many orders does no harm.
    """
    u = np.ones(len(w))
    if not w @ u > 0:
        raise GeometryError(_NONE)
    barrier, reference = 1.0, np.full(len(opposite), np.sqrt(3) / 4)
    for count in range(1, _STEPS):
        sides = u[opposite]
        area, cotangents = areas_cotangents(sides)
        ratio = barrier * reference / area
        root = np.sqrt(1 + ratio**2)
        first = root + ratio  # phi'(S), and below S phi''(S)
        second = -ratio * first / root
        gradient = summed(opposite, first[:, None] * cotangents / 4, len(u))
        blocks = blocks_of(sides, area, cotangents, first, second - first)
        solved = u[:, None] * normal.factorised(blocks).solve(np.column_stack([gradient * u, w * u]))
        change = solved[:, 0] - (w @ solved[:, 0]) / (w @ solved[:, 1]) * solved[:, 1]
        if not np.isfinite(change).all():
            break
        step = min(1.0, 0.95 * longest_step(sides, change[opposite]).min())
        u = u + step * change
        if step > 0.5:
            if barrier < 1e-6:  # Newton's method converges from there
                return u, count
            barrier, reference = 0.1 * barrier, np.sqrt(heron(u[opposite])) / 4
    raise GeometryError(_NONE)


def _newton(w: NDArray, opposite: NDArray, normal: Normal, u: NDArray, steps: int) -> NDArray:
    """Newton's method for w(u) = w / c, until the misfit no longer falls.

    The matrix has the null vector u, to which the misfit is orthogonal if c is chosen so: a shift next to rounding
    makes it definite.
    """
    best, least, before = u, np.inf, np.inf
    for _ in range(max(steps, 1)):
        sides = u[opposite]
        area, cotangents = areas_cotangents(sides)
        own = summed(opposite, cotangents / 2, len(u))
        misfit = own - w * ((own @ u) / (w @ u))
        left = float(np.linalg.norm(misfit) / np.linalg.norm(own))
        if left <= least:
            best, least = u, left
        if not np.isfinite(left) or 0.1 * before < left < 1e-9:
            break
        before = left
        ones = np.ones(len(area))
        change = u * normal.factorised(2 * blocks_of(sides, area, cotangents, ones, -ones), 1e-10).solve(misfit * u)
        change -= u * ((own @ change) / (own @ u))
        u = u + min(1.0, 0.9 * longest_step(sides, change[opposite]).min()) * change
    return best
