"""Lengths of edges from whole entries, and a rim such that the mesh is flat.

Where the lengths of edges without a whole entry are given, all others follow from a convex problem, as those of a
whole surface do (:mod:`..metric.program`): the least w . u - 2 sum of areas over squared lengths u of the edges with
entries w. So entries are met exactly, from any start, and what is left to find is the rim: curvatures inside, 2 pi less
the angles at a vertex, are brought to zero by Gauss-Newton steps along the metrics with these entries, a sparse saddle
point problem each. Such metrics differ by conformal factors, and curvature is nearly linear in the logarithm of one,
where positions that have to fit entries creep along narrow, bent valleys.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import GeometryError, SolverError
from ..linalg import Factorisation, UpperTriangle, factorisation
from ..metric.heron import angles, areas_cotangents, blocks_of, heron, longest_step, summed
from ..planar.conformal import conformal_map
from ..planar.frame import fit_similarity
from ..planar.polish import polish
from ..tolerances import LAST_DIGITS, ROUNDED, SUMMED
from ..topology.pieces import planar_pieces
from .first import SLOWLY
from .fit import FitOptions, WholeEntries, WholeEntriesFit
from .rim import Rim

_log = logging.getLogger(__name__)

_OPTIONS = FitOptions(steps=5, last_steps=15, trials=4)
_MOST = 400  # factorisations, more than meshes that come back this way need


@dataclass(frozen=True, eq=False)
class _Metric:
    """Squared lengths with whole entries, and what they leave."""

    u: NDArray[np.float64]  # (e,)
    scale: float
    weights: NDArray[np.float64]  # (e,) halves of cotangents
    curvature: NDArray[np.float64]  # (inner vertices,) 2 pi less the sum of angles
    bulge: NDArray[np.float64]  # (p,) of the prior
    hessian: sp.csr_array  # (e, e) of areas, by log u

    @property
    def bent(self) -> float:
        """Root mean square of the curvature."""
        return float(np.linalg.norm(self.curvature)) / np.sqrt(max(len(self.curvature), 1))

    def cost(self, mu: float) -> float:
        return float(self.curvature @ self.curvature + mu**2 * (self.bulge @ self.bulge))


@np.errstate(all="ignore")  # a step of a problem without answer may be of any size, and ends as no metric
def fit_lengths(
    problem: WholeEntries, rim: Rim, z: NDArray[np.complex128], newton: FitOptions
) -> tuple[WholeEntriesFit, Rim] | None:
    """A fit of whole entries by way of lengths, and its rim; None where no flat metric is found.

    Positions z (n,) are those to start from. Where the rim comes to no flat metric, it is peeled next to peaks of the
    curvature.
    """
    piece, fading = rim.piece, SLOWLY
    scale = float(problem.best_scale(z, rim.whole)[0])
    u = np.abs(z[piece.edges[:, 1]] - z[piece.edges[:, 0]]) ** 2
    if not (heron(u[piece.opposite]) > 0).all():
        u = np.ones(len(u))
    if not scale > 0:
        return None
    left = _MOST
    while left > 0:
        lengths = _Lengths(rim, problem.weights, left)
        try:
            here = lengths.convex(u[lengths.edges], scale)
            if here is None or not len(lengths.inside):
                return None
            here = lengths.flat(here, fading, free_scale=problem.known_scale is None)
            if here.bent <= ROUNDED:
                found = _laid_out(rim, lengths.edges, here.weights, z)
                if found is None:
                    return None
                return problem.fit(found[0], np.array([here.scale]), found[1].whole, 0.0, newton), found[1]
        except (GeometryError, SolverError):
            return None
        u[lengths.edges], scale, fading, left = here.u, here.scale, SLOWLY[2:], lengths.left
        hot = np.zeros(piece.n_vertices)
        hot[lengths.inside] = np.abs(here.curvature)
        less = rim.peeled(hot[piece.edges].max(axis=1), 0.25 * float(hot.max()))
        if less is None or not (rim := less.pruned()).whole.any():
            return None
    return None


def _laid_out(
    rim: Rim, edges: NDArray[np.int64], weights: NDArray[np.float64], z: NDArray[np.complex128]
) -> tuple[NDArray[np.complex128], Rim] | None:
    """Positions (n,) of the largest part that edges join, others as in z; and the rim of this part."""
    piece = rim.piece
    local = np.full(len(piece.edges), -1)
    local[edges] = np.arange(len(edges))
    parts = planar_pieces(
        piece.n_vertices, piece.edges[edges], piece.triangles[rim.left], local[piece.opposite[rim.left]]
    )
    if not parts:
        return None
    part = max(parts, key=lambda one: one.n_vertices)
    flat = polish(part, weights[part.edge_rows], conformal_map(part, weights[part.edge_rows], scale=1.0).z, scale=1.0).z
    here = part.vertices
    similarity = min((fit_similarity(flat, z[here], mirror=mirror) for mirror in (False, True)), key=lambda one: one[1])
    found = z.copy()
    found[here] = similarity[0](flat)
    own = np.zeros(len(piece.edges), dtype=bool)
    own[edges[part.edge_rows]] = True
    return found, replace(rim, left=rim.left & own[piece.opposite].all(axis=1))


class _Lengths:
    """The problem on the triangles that a rim leaves, for so many factorisations."""

    def __init__(self, rim: Rim, weights: NDArray[np.float64], most: int):
        piece = rim.piece
        self.edges, sides = np.unique(piece.opposite[rim.left], return_inverse=True)
        self.sides, self.triangles = sides.reshape(-1, 3), piece.triangles[rim.left]
        self.given, self.whole = weights[self.edges], rim.whole[self.edges]
        count = np.bincount(self.triangles.ravel(), minlength=piece.n_vertices)
        around = np.bincount(piece.triangles.ravel(), minlength=piece.n_vertices)
        around[piece.boundary.ravel()] = 0
        self.inside = np.flatnonzero((count > 0) & (count == around))
        self._number = np.full(piece.n_vertices, -1)
        self._number[self.inside] = np.arange(len(self.inside))
        owner, place = np.nonzero(~self.whole[self.sides])
        ends = np.stack([self.sides[owner, (place + turn) % 3] for turn in (0, 1, 2)], axis=1)
        share = np.tile([1.0, -0.5, -0.5], (len(ends), 1))
        row = np.repeat(np.arange(len(ends)), 3)
        self.prior = sp.csr_array((share.ravel(), (row, ends.ravel())), shape=(len(ends), len(self.edges)))
        self._convex: Factorisation | None = None
        self.left = most

    def at(self, u: NDArray, scale: float) -> _Metric | None:
        """A metric with its derivatives; None where some triangle has no area."""
        own = u[self.sides]
        if not (u > 0).all() or not (heron(own) > 1e-14 * own.max(axis=1) ** 2).all():
            return None
        area, cotangents = areas_cotangents(own)
        ones = np.ones(len(area))
        blocks = -2 * blocks_of(own, area, cotangents, ones, -ones)
        size, row, column = len(u), np.repeat(self.sides, 3, axis=1).ravel(), np.tile(self.sides, (1, 3)).ravel()
        hessian = sp.csr_array((blocks.ravel(), (row, column)), shape=(size, size))
        total = np.bincount(self.triangles.ravel(), angles(own).ravel(), len(self._number))[self.inside]
        curvature = np.asarray(2 * np.pi - total, dtype=np.float64)
        weights = summed(self.sides, cotangents / 2, len(u))
        return _Metric(u, scale, weights, curvature, self.prior @ np.log(u), hessian)

    def turn(self, u: NDArray) -> sp.csr_array:
        """Derivatives of the curvature inside by log u."""
        cotangents = areas_cotangents(u[self.sides])[1]
        # An angle: by the sides at it minus half a cotangent of the third angle, and by the one that faces it what
        # makes the sum zero.
        total = cotangents.sum(axis=1)
        turn = (cotangents[:, :, None] + cotangents[:, None, :] - total[:, None, None]) / 2
        corner = np.arange(3)
        turn[:, corner, corner] = (total[:, None] - cotangents) / 2
        row, column = np.repeat(self._number[self.triangles], 3, axis=1).ravel(), np.tile(self.sides, (1, 3)).ravel()
        some = row >= 0
        return sp.csr_array((-turn.ravel()[some], (row[some], column[some])), shape=(len(self.inside), len(u)))

    def convex(self, u: NDArray, scale: float) -> _Metric | None:
        """With whole entries, lengths of other edges given; None where there is none."""
        free = np.flatnonzero(self.whole)
        wanted, last = self.given / scale, np.inf
        for _ in range(60):
            here = self.at(u, scale)
            if here is None:
                return None
            rest = (here.weights - wanted)[free]
            size = float(np.abs(rest).max(initial=0.0))
            if size < LAST_DIGITS or (size < SUMMED and size > last / 2):
                return here
            last = size
            matrix = UpperTriangle.of(sp.csr_array(-here.hessian[free][:, free]))
            self._convex = self._convex or factorisation(matrix, definite=True)
            self._convex.factorise(matrix)
            self.left -= 1
            move = np.zeros(len(u))
            move[free] = self._convex.solve(np.ascontiguousarray(rest * u[free]))
            longest = longest_step(u[self.sides], (u * move)[self.sides]).min()
            step = min(1.0, 0.95 * longest, 0.9 / max(-move.min(), 1e-300))
            u = u * (1 + step * move)
        return None

    def flat(self, here: _Metric, mus: Sequence[float], *, free_scale: bool) -> _Metric:
        """The metric that comes nearest to a flat one, with less and less of a prior for the rim while that helps."""
        last = np.inf
        for mu in mus:
            damping, cost = 1e-8, here.cost(mu)
            for _ in range(_OPTIONS.steps if mu else _OPTIONS.last_steps):
                before = cost
                for _ in range(_OPTIONS.trials):
                    found = self._tried(here, mu, damping, free_scale=free_scale)
                    if found is not None and found.cost(mu) < cost:
                        here, cost, damping = found, found.cost(mu), damping / 10
                        break
                    damping = max(10 * damping, 1e-7)
                if self.left <= 0 or cost <= ROUNDED**2 * len(self.inside) or cost > (1 - 1e-3) * before:
                    break
            _log.debug("mu %.0e: curvature %.1e, %d factorisations left", mu, here.bent, self.left)
            if self.left <= 0 or not ROUNDED < here.bent < 0.95 * last:  # less of a prior no longer helps
                break
            last = here.bent
        return here

    def _tried(self, here: _Metric, mu: float, damping: float, *, free_scale: bool) -> _Metric | None:
        move, more = self._towards_flat(here, mu, damping, free_scale=free_scale)
        share = min(1.0, 1.5 / max(float(np.abs(move[~self.whole]).max(initial=0.0)), 1e-300))
        scale = here.scale * float(np.exp(np.clip(share * more, -1, 1)))
        for some in (True, ~self.whole):
            found = self.convex(here.u * np.exp(np.where(some, share * move, 0.0)), scale)
            if found is not None:
                return found
        return None

    def _towards_flat(self, here: _Metric, mu: float, damping: float, *, free_scale: bool) -> tuple[NDArray, float]:
        """A Gauss-Newton step of log u and log c along the metrics with whole entries.

        The matrix of the saddle point is that of a problem in which entries have a little room, which needs no pivots;
        a few corrections close it.
        """
        e, free = len(self.edges), np.flatnonzero(self.whole)
        slope = self.given[free] / here.scale if free_scale else np.zeros(len(free))
        rows = sp.hstack([sp.diags_array(1 / here.u[free]) @ here.hessian[free], sp.csr_array(slope[:, None])])
        turn = self.turn(here.u)
        square = turn.T @ turn + mu**2 * (self.prior.T @ self.prior)
        own = np.append(np.where(self.whole, 1e-12, damping), 1e-12 if free_scale else 1.0)
        square = sp.block_diag([square, sp.csr_array((1, 1))]) + sp.diags_array(own)
        room = np.append(np.zeros(e + 1), np.full(len(free), 1e-6))
        matrix = sp.csr_array(sp.block_array([[square, rows.T], [rows, None]]))
        upper = UpperTriangle.of(sp.csr_array(matrix - sp.diags_array(room)))
        solver = factorisation(upper)
        solver.factorise(upper)
        self.left -= 1
        right = np.zeros(len(room))
        right[:e] = -(turn.T @ here.curvature) - mu**2 * (self.prior.T @ here.bulge)
        right[e + 1 :] = self.given[free] / here.scale - here.weights[free]
        x = np.zeros(len(room))
        for _ in range(6):
            x += solver.solve(right - matrix @ x)
        return x[:e], float(x[e])
