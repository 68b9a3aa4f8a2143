"""A mesh that fits those entries that are whole: Levenberg-Marquardt on positions and c.

Minimised is

    sum over whole entries of (a_e / c - w_e(z))^2 + mu^2 sum over triangles with others of their shape prior squared ,

a_e = -A_ij. The prior holds what few entries hold, and fades: each mu starts where the one before has ended, the last
is zero. Cotangents have poles where triangles are flat, and meshes beyond them are no meshes: steps end before any
triangle turns over. Regions may have factors of their own: then misfits are those of a_e, and of half a cotangent times
its region's factor from each triangle, in units of the mean of these factors.

References
----------
Madsen, Nielsen, Tingleff, "Methods for non-linear least squares problems", 2004.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import SolverError
from ..linalg import Factorisation, UpperTriangle, factorisation
from ..planar.cotangent import edge_weights, halves, weight_gradient
from ..topology import Piece
from .shape import ShapePrior

_log = logging.getLogger(__name__)

EXACT = 1e-12  # root mean square misfit of whole entries that is none, in units of typical ones


@dataclass(frozen=True)
class FitOptions:
    """Settings of the iteration."""

    steps: int = 12  # most of them for one mu
    last_steps: int = 30  # for mu = 0
    near: float = 1e-2  # a step that leaves less than this of the squares is followed by one with the same factor
    exact: float = 1e-13  # root mean square misfit, in units of typical weights, that is rounding
    damping: float = 1e-6  # to begin with, in units of the diagonal of the normal matrix
    trials: int = 12  # of a step, each with ten times the damping
    shortest: float = 0.0  # part of a step below which the iteration ends: a few places hold all others up


@dataclass(frozen=True, eq=False)
class WholeEntriesFit:
    """Where the iteration has ended."""

    z: NDArray[np.complex128]
    scale: NDArray[np.float64]  # (k,) c of each region
    misfit: float  # root mean square of a / c - w over whole entries
    prior: float  # root of the sum of squares of the prior


class WholeEntries:
    """The problem on one piece; the pattern of its normal matrix is analysed once.

    Given are -A_ij of each edge (e,), of any size where entries are not whole; (e,) bool, weights that are about right
    where they are not whole, which count as the prior does; c (k,), where it is known; vertices (n,) bool that move,
    where all others stay, and entries of these alone are left out; and the region of each triangle, all the same one by
    default.
    """

    def __init__(
        self, piece: Piece, weights: NDArray, guessed: NDArray[np.bool_], scale: NDArray | None = None,
        free: NDArray[np.bool_] | None = None, region: NDArray[np.int64] | None = None,
    ):  # fmt: skip
        self.piece, self.weights, self.guessed, self.known_scale = piece, weights, guessed, scale
        self.region = np.zeros(len(piece.triangles), np.int64) if region is None else region
        self.free = np.ones(piece.n_vertices, dtype=bool) if free is None else free
        self.asked = self.free[piece.stencil].any(axis=0)
        count = int(self.free.sum())
        self.place = np.where(self.free, np.cumsum(self.free) - 1, count)  # one column of zeros for all that stay
        self.columns = count + (count < len(self.free))
        self._factor: Factorisation | None = None

    def analysed(self, matrix: UpperTriangle) -> Factorisation:
        """To factorise normal matrices of all entries with."""
        if self._factor is None:
            self._factor = factorisation(matrix, definite=True)
        return self._factor

    def best_scale(self, z: NDArray, whole: NDArray[np.bool_]) -> NDArray[np.float64]:
        """(1,) c that fits positions best, where all have the same."""
        if self.known_scale is not None:
            return self.known_scale
        w, a = edge_weights(self.piece, z)[whole], self.weights[whole]
        return np.array([w @ a / (w @ w)])

    def misfits(self, z: NDArray, scale: NDArray) -> NDArray[np.float64]:
        """(e,) a / c - w."""
        return np.asarray((self.weights - edge_weights(self.piece, z, scale[self.region])) / self.unit(scale))

    def gradient(self, z: NDArray, scale: NDArray) -> NDArray[np.complex128]:
        """(4, e) as :func:`..planar.cotangent.weight_gradient` has it."""
        return weight_gradient(self.piece, z, scale[self.region]) / self.unit(scale)

    def slopes(self, z: NDArray, scale: NDArray) -> NDArray[np.float64]:
        """(e, k) what misfits change by with -log c, of each region; no columns where c is known."""
        if self.known_scale is not None:
            return np.zeros((len(self.weights), 0))
        sides, unit = self.piece.opposite, self.unit(scale)
        with_unit = self.misfits(z, scale) / (self.piece.inner + 1)
        part = (halves(self.piece, z) + with_unit[sides]) * scale[self.region][:, None] / unit[sides]
        place = sides.ravel(), np.repeat(self.region, 3)
        return sp.coo_array((part.ravel(), place), shape=(len(self.weights), len(scale))).toarray()

    def _scaled(self, scale: NDArray, move: NDArray) -> NDArray[np.float64]:
        """Factors whose logarithms have changed; where c is known it stays."""
        return scale if self.known_scale is not None else scale * np.exp(move)

    def unit(self, scale: NDArray) -> NDArray[np.float64]:
        """(e,) the mean of c on both sides of each edge."""
        one, other = scale[self.region][self.piece.facing // 3].T
        return np.asarray(np.where(self.piece.inner, (one + other) / 2, one))

    def fit(
        self, z: NDArray, scale: NDArray, whole: NDArray[np.bool_], mu: float, options: FitOptions | None = None
    ) -> WholeEntriesFit:
        """Improve positions in which no triangle is turned over; sides of other entries have a prior of weight mu."""
        options = options or FitOptions()
        prior = ShapePrior.of(self.piece, ~whole)
        count, damping, small = max(int(whole.sum()), 1), options.damping, 0
        misfit, shape = self.residuals(z, scale, whole, prior, mu)
        cost = float(misfit @ misfit + shape @ shape)
        for _ in range(options.steps if mu else options.last_steps):
            if not mu and misfit @ misfit <= count * options.exact**2:
                break
            system = System(self, z, scale, whole, prior, mu, misfit, shape)
            better = None
            for _ in range(options.trials):
                step = self.step(system, damping)
                if step is not None:
                    better = self._along(z, scale, *step, whole, prior, mu, cost)
                if better is not None:
                    break
                damping = max(10 * damping, 1e-12)
            if better is None:
                break
            z, scale, misfit, shape, share = better
            before, cost = cost, float(misfit @ misfit + shape @ shape)
            last = before
            while share == 1 and cost <= options.near * last:
                step = self._solved(system.towards(misfit, shape))  # so near that the same factor does
                better = None if step is None else self._along(z, scale, *step, whole, prior, mu, cost)
                if better is None:
                    break
                z, scale, misfit, shape, share = better
                last, cost = cost, float(misfit @ misfit + shape @ shape)
            damping = max(damping / 10, 1e-15) if share == 1 else 1.5 * damping
            small = small + 1 if cost > (1 - 1e-3) * before else 0
            if small >= (1 if mu else 4) or share < options.shortest:
                break
        # What rounding of positions does not leave, which is next to nothing while there is a prior.
        reach = 0.0 if mu else 4 * np.spacing(np.abs(z - z[0]).max()) * np.abs(self.gradient(z, scale)).sum(axis=0)
        beyond = np.maximum(np.abs(misfit) - reach, 0)[whole]
        rest, size = float(np.linalg.norm(beyond)) / np.sqrt(count), float(np.linalg.norm(prior.residual(z)))
        _log.debug("mu %.0e: misfit %.1e, prior %.1e", mu, rest, size)
        return WholeEntriesFit(z, scale, rest, size)

    def moved(self, fit: WholeEntriesFit, whole: NDArray[np.bool_], step: NDArray[np.complex128]) -> WholeEntriesFit:
        """Positions displaced by a step (n,), with the factors that are best then, if whole entries fit no worse."""

        def misfit(z: NDArray, scale: NDArray) -> NDArray:
            return np.where(whole, self.misfits(z, scale), 0.0)

        z = fit.z + step
        slopes = np.where(whole[:, None], self.slopes(z, fit.scale), 0.0)
        scale = self._scaled(fit.scale, np.linalg.lstsq(slopes, misfit(z, fit.scale), rcond=None)[0])
        better = np.linalg.norm(misfit(z, scale)) < np.linalg.norm(misfit(fit.z, fit.scale))
        return replace(fit, z=z, scale=scale) if better else fit

    def faded(self, z: NDArray, scale: NDArray, whole: NDArray[np.bool_], mus: Sequence[float]) -> WholeEntriesFit:
        """One fit after the other, with less and less prior."""
        for mu in mus:
            found = self.fit(z, scale, whole, mu)
            z, scale = found.z, found.scale
        return found

    def trust(self, whole: NDArray, mu: float) -> NDArray[np.float64]:
        """(e,) weights of entries; guessed ones have some of the prior's, and less than whole entries."""
        return np.where(whole, 1.0, min(10 * mu, 0.3) * (self.guessed & self.asked))

    def residuals(
        self, z: NDArray, scale: NDArray, whole: NDArray, prior: ShapePrior, mu: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Misfits of entries (e,) and of the prior, weighted."""
        return self.trust(whole, mu) * self.misfits(z, scale), mu * prior.residual(z)

    def step(self, system: System, damping: float | NDArray) -> tuple[NDArray, NDArray] | None:
        """Displacement, and changes (k,) of log c if it is free; None where the normal matrix cannot be factorised."""
        matrix = system.damped(damping)
        try:
            self.analysed(matrix).factorise(matrix)
        except SolverError:
            return None
        system.response = None
        return self._solved(system)

    def _solved(self, system: System) -> tuple[NDArray, NDArray] | None:
        """The same with the factor that is there."""
        assert self._factor is not None
        if system.response is None:
            solved = self._factor.solve(np.column_stack([system.right, system.slope]))
            gradient, system.response = solved[:, 0], solved[:, 1:]
        else:
            gradient = self._factor.solve(system.right)
        left = system.size - system.slope.T @ system.response
        if not np.isfinite(left).all():
            return None
        np.fill_diagonal(left, np.maximum(left.diagonal(), 1e-12 * system.size.diagonal()))
        move = np.linalg.lstsq(left, system.along - system.slope.T @ gradient, rcond=None)[0]
        step = np.ascontiguousarray(gradient - system.response @ move).view(np.complex128)
        step = np.append(step, 0)[np.where(self.free, self.place, len(step))]
        return (step, move) if np.isfinite(step).all() and np.isfinite(move).all() else None

    def _along(
        self, z: NDArray, scale: NDArray, step: NDArray, move: NDArray, whole: NDArray, prior: ShapePrior, mu: float,
        cost: float,
    ) -> tuple[NDArray, NDArray, NDArray, NDArray, float] | None:  # fmt: skip
        """The longest part of a step, of a few, that turns no triangle over and lowers the cost."""
        fitted = self.piece.triangles[(whole[self.piece.opposite] | (mu > 0)).any(axis=1)]
        flip = float(first_flips(fitted, z, step).min(initial=np.inf))
        share = min(1.0, 0.5 / max(np.abs(move).max(initial=0.0), 1e-300), 0.9 * flip)
        for _ in range(5):
            there, c = z + share * step, self._scaled(scale, share * move)
            with np.errstate(all="ignore"):
                misfit, shape = self.residuals(there, c, whole, prior, mu)
                if misfit @ misfit + shape @ shape < cost:
                    return there, c, misfit, shape, share
            share *= 0.4
        return None


class System:
    """The linearised problem: normal matrix, right-hand side, and the columns of log c beside them."""

    def __init__(
        self, problem: WholeEntries, z: NDArray, scale: NDArray, whole: NDArray, prior: ShapePrior, mu: float,
        misfit: NDArray, shape: NDArray,
    ):  # fmt: skip
        piece, free = problem.piece, problem.free
        trust = problem.trust(whole, mu)
        entries = trust * np.where(free[piece.stencil], problem.gradient(z, scale), 0)
        gradient = mu * np.where(free[prior.corners], prior.gradient(z), 0)
        parts = [(entries, problem.place[piece.stencil]), (gradient, problem.place[prior.corners])]
        jacobian = jacobian_rows(problem.columns, parts)
        self.jacobian_transposed = jacobian.T.tobsr()
        self._upper = UpperTriangle.of(self.jacobian_transposed @ jacobian)
        self._slopes = trust[:, None] * problem.slopes(z, scale)
        self.slope = self.jacobian_transposed @ np.pad(self._slopes, ((0, len(shape)), (0, 0)))
        self.size = self._slopes.T @ self._slopes
        self.response: NDArray | None = None  # to the slope, once it is solved for
        self.towards(misfit, shape)

    def towards(self, misfit: NDArray, shape: NDArray) -> System:
        """With other right-hand sides."""
        self.right = self.jacobian_transposed @ np.concatenate([misfit, -shape])
        self.along = self._slopes.T @ misfit
        return self

    def damped(self, damping: float | NDArray) -> UpperTriangle:
        """The matrix with its diagonal enlarged."""
        data, start = self._upper.data.copy(), self._upper.indptr[:-1]
        diagonal = np.diagonal(data[start], axis1=1, axis2=2)
        more = np.reshape(damping, (-1, 1)) * diagonal + 1e-14 * np.median(diagonal)
        data[start] += more[:, :, None] * np.eye(2)
        return self._upper.with_data(data)


def jacobian_rows(n: int, parts: list[tuple[NDArray, NDArray]]) -> sp.bsr_array:
    """Rows Re sum_k g_k dz_(v_k) for gradients and vertices (k, m) each, in blocks of x and y."""
    blocks = [np.stack([g.real.T, -g.imag.T], axis=-1).reshape(-1, 1, 2) for g, _ in parts]
    vertices = [v.T.astype(np.int32).ravel() for _, v in parts]
    count = np.concatenate([np.full(g.shape[1], len(g)) for g, _ in parts])
    indptr = np.append(0, np.cumsum(count)).astype(np.int32)
    shape = (len(count), 2 * n)
    return sp.bsr_array((np.concatenate(blocks), np.concatenate(vertices), indptr), shape=shape)


def first_flips(triangles: NDArray, z: NDArray, step: NDArray) -> NDArray[np.float64]:
    """(m,) the least t > 0 at which each triangle of z + t step is flat; infinite if there is none, or it is folded."""
    (a, b, c), (da, db, dc) = z[triangles].T, step[triangles].T
    u, v, du, dv = b - a, c - a, db - da, dc - da
    constant, square = (np.conj(u) * v).imag, (np.conj(du) * dv).imag
    linear = (np.conj(u) * dv + np.conj(du) * v).imag
    root = linear**2 - 4 * square * constant
    with np.errstate(all="ignore"):
        times = 2 * constant / (np.stack([np.sqrt(root), -np.sqrt(root)]) - linear)
        return np.asarray(np.where((times > 0) & (constant > 0), times, np.inf).min(axis=0))
