"""Triangles that belong to the region beside them: what the misfit of a fit shows, geometry taken out.

Changing triangle t to a region with another factor adds a column b_t to the linearised problem. With the projection P
from what displacements and factors take up, changes are those numbers between 0 and 1 that make |P (r - sum_t a_t b_t)|
least, r the misfit: all that is wrong shows at once, as far as it is small. Beside a rim, which takes up much of
anything, too many do, and changes are first made one by one, of all of b_t: always the one that takes most off the
squares of what is left of the misfit, 2 r'P b_t - |P b_t|^2, as long as any does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from ..boundaries.fit import System, WholeEntries
from ..boundaries.shape import ShapePrior
from ..errors import SolverError
from ..planar.cotangent import halves
from .guess import corners_of


def exchanges(
    problem: WholeEntries, z: NDArray[np.complex128], scale: NDArray, whole: NDArray[np.bool_]
) -> Iterator[NDArray[np.int64]]:
    """Regions (m,) of which some triangles are another's, the likeliest first.

    At positions z (n,) and factors (k,) whole entries, (e,) bool, are fitted, as far as they go.
    """
    piece, region, misfit = problem.piece, problem.region, np.where(whole, problem.misfits(z, scale), 0.0)
    triangle, other = _beside(problem, whole)
    half = halves(piece, z)[triangle]
    sides = piece.opposite[triangle]
    column = half * (scale[other] - scale[region[triangle]])[:, None] / problem.unit(scale)[sides]
    column = np.where(whole[sides], column, 0.0)
    score = np.nan_to_num((column * misfit[sides]).sum(axis=1) / np.sqrt((column**2).sum(axis=1)), nan=-np.inf)
    hot = np.abs(misfit[sides]).max(axis=1)

    @cache
    def shares(only: bool) -> tuple[NDArray[np.int64], _Shares]:
        order = np.argsort(-(score if only else hot))[:300]
        order = order[score[order] > 0] if only else order
        return order, _Shares.of(problem, z, scale, misfit, whole, column[order], sides[order])

    def exchanged(which: NDArray[np.int64]) -> NDArray[np.int64]:
        new = region.copy()
        new[triangle[which]] = other[which]
        return new

    if not whole.all():
        order, found = shares(False)
        greedy = found.greedy
        for several in (greedy[:1], greedy):
            yield exchanged(order[several])
    # above which number triangles change, and whether only those are candidates that entries speak for by themselves
    for least, only in ((0.5, True), (0.5, False), (0.25, True), (0.9, True)):
        order, found = shares(only)
        if (found.between > least).any():
            yield exchanged(order[found.between > least])
    # One alone, of those next to the largest misfits: the likeliest by direction, and by what all of it would take off;
    # then the nearest, since on the boundary positions take up nearly all of a change to first order.
    order, found = shares(False)
    direction = found.along / np.sqrt(np.maximum(found.square, np.finfo(float).tiny))
    for rank in (direction, 2 * found.along - found.square, hot[order]):
        for one in order[np.argsort(-rank, kind="stable")[:6]]:
            yield exchanged(one)


def _beside(problem: WholeEntries, whole: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles with a whole entry, and regions other than theirs that they share a vertex with."""
    piece, region, m = problem.piece, problem.region, len(problem.piece.triangles)
    corners = corners_of(piece)
    kinds = sp.csr_array((np.ones(m), region, np.arange(m + 1)), shape=(m, int(region.max()) + 1))
    triangle, other = sp.coo_array(corners @ (corners.T @ kinds)).coords
    change = (other != region[triangle]) & whole[piece.opposite[triangle]].any(axis=1)
    return triangle[change], other[change]


@dataclass(frozen=True, eq=False)
class _Shares:
    """What columns say of a misfit once displacements and factors have taken up what they can."""

    along: NDArray[np.float64]  # (k,) products of what is left of each column with the misfit
    gram: NDArray[np.float64]  # (k, k) products of what is left of any two columns

    @cached_property
    def between(self) -> NDArray[np.float64]:
        """(k,) Numbers between 0 and 1 of all columns together."""
        value, vector = np.linalg.eigh((self.gram + self.gram.T) / 2)
        if not value.max(initial=0.0) > 0:  # displacements and factors take all of them up
            return np.zeros(len(self.along))
        root = np.sqrt(np.maximum(value, 1e-8 * value.max()))
        return np.asarray(lsq_linear((vector * root).T, (vector / root).T @ self.along, bounds=(0, 1)).x)

    @property
    def square(self) -> NDArray[np.float64]:
        """(k,) squares of what is left of each column."""
        return np.diagonal(self.gram)

    @property
    def greedy(self) -> NDArray[np.int64]:
        """Columns that, as a whole and after the ones before, take most off."""
        left, chosen = self.along.copy(), list[int]()
        while (gain := 2 * left - self.square).max(initial=0.0) > 0:
            chosen.append(int(gain.argmax()))
            left -= self.gram[chosen[-1]]
            left[chosen[-1]] = -np.inf
        return np.array(chosen, dtype=np.int64)

    @classmethod
    def of(
        cls, problem: WholeEntries, z: NDArray, scale: NDArray, misfit: NDArray, whole: NDArray, column: NDArray,
        sides: NDArray,
    ) -> _Shares:  # fmt: skip
        """Of columns with entries (k, 3) at sides (k, 3)."""
        count = len(column)
        none = cls(np.zeros(count), np.zeros((count, count)))
        if not count:
            return none
        added = sp.csr_array((column.ravel(), sides.ravel(), np.arange(0, 3 * count + 1, 3)), (count, len(misfit)))
        no_prior = ShapePrior(np.empty((3, 0), dtype=np.int64))
        system = System(problem, z, scale, whole, no_prior, 0.0, misfit, np.zeros(0))
        matrix = system.damped(1e-10)
        try:
            factor = problem.analysed(matrix)
            factor.factorise(matrix)
        except SolverError:
            return none
        pulled = sp.csr_array((system.jacobian_transposed @ added.T).T)
        response = factor.solve(system.slope)
        along = added @ (whole[:, None] * problem.slopes(z, scale)) - pulled @ response
        gram = (added @ added.T).toarray()
        for first in range(0, count, 32):
            some = slice(first, first + 32)
            gram[:, some] -= pulled @ factor.solve(np.ascontiguousarray(pulled[some].T.toarray()))
        gram -= along @ np.linalg.lstsq(system.size - system.slope.T @ response, along.T, rcond=None)[0]
        return cls(added @ misfit, gram) if np.isfinite(gram).all() else none
