"""Squared lengths of all edges, and c, from the entries of c L + s M: Levenberg-Marquardt, one edge an unknown.

In units of length in which s = 1, with w the weights of the Laplacian and a the areas,

    -A_ij = c w_ij - (sum of a over the triangles of ij) / 12,      (A 1)_i = (sum of a over the triangles at i) / 3.

These are e + n equations for e + 1 unknowns, and local: row sums tell sizes where they stand, so that no smooth
deformation of the whole mesh has to be found, and some seven steps do at any number of vertices. The weights of a
triangle with small angles are inversely proportional to its area; what is compared is 2 w / sqrt(1 + 4 w^2), for a
single triangle the cosine of the angle, which is linear in the square of the side that faces it: no step overshoots
there. Positions follow from the metric by the linear solve of the Laplacian.
"""

import logging
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import SolverError
from ..linalg import UpperTriangle, factorisation
from ..tolerances import HARDLY_ANY
from .metric import Metric, Skeleton

_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class _Equations:
    """Entries (e,), row sums (n,), all positive, and weights of the latter (n,)."""

    skeleton: Skeleton
    entries: NDArray[np.float64]
    sums: NDArray[np.float64]
    trust: NDArray[np.float64]

    def residual(self, metric: Metric, c: float) -> NDArray[np.float64]:
        """(e + n,) cosines given minus fitted, and row sums fitted over given, minus one."""
        k, given = self._unit(c), self._given(metric) / c
        one, other = (k * w / np.sqrt(1 + (k * w) ** 2) for w in (given, metric.weights))
        areas = self.skeleton.at_vertices @ metric.areas / (3 * self.sums) - 1
        return np.concatenate([one - other, self.trust * areas])

    def derivative(self, metric: Metric, c: float) -> tuple[sp.csr_array, NDArray[np.float64]]:
        """(e + n, e) by the logarithms of u, and (e + n,) by that of c."""
        of_weights, of_areas = metric.derivatives()
        k, given = self._unit(c), self._given(metric) / c
        slope_given, slope = (k * (1 + (k * w) ** 2) ** -1.5 for w in (given, metric.weights))
        cosines = sp.diags_array(slope_given / (12 * c)) @ (self.skeleton.at_edges @ of_areas)
        cosines = cosines - sp.diags_array(slope) @ of_weights
        sums = sp.diags_array(self.trust / (3 * self.sums)) @ (self.skeleton.at_vertices @ of_areas)
        by_c = np.concatenate([-slope_given * given, np.zeros(len(self.sums))])
        return sp.csr_array(sp.vstack([cosines, sums])), by_c

    def _given(self, metric: Metric) -> NDArray[np.float64]:
        """(e,) c w, as entries and areas have it."""
        return np.asarray(self.skeleton.at_edges @ metric.areas / 12 - self.entries)

    def _unit(self, c: float) -> NDArray[np.float64]:
        """(e,) of weights: for 60 degrees they are then about 1; less where masses of the entry's size change more."""
        of_mass = 3 * (self.sums / self.skeleton.degree)[self.skeleton.edges].mean(axis=1) / 12
        return np.asarray(2 / self.skeleton.sides * abs(c) / (abs(c) + of_mass))

    def start(self) -> tuple[Metric, float]:
        """Circles about the vertices whose neighbours touch: they have triangles, and sizes from the row sums."""
        radius = np.sqrt(self.sums / self.skeleton.degree * np.sqrt(3))  # of equilateral triangles
        metric = Metric(self.skeleton, radius[self.skeleton.edges].sum(axis=1) ** 2)
        ratio = self._given(metric) / metric.weights
        return metric, float(np.sign(np.median(ratio)) * np.median(np.abs(ratio)))


@np.errstate(all="ignore")  # of a misfit that is not finite nothing comes
def fit_metric(skeleton: Skeleton, entries: NDArray, sums: NDArray, trust: NDArray) -> tuple[Metric, float] | None:
    """The metric with which a mesh has these entries, c being any; None where the iteration breaks down.

    `skeleton`: all edges at triangles; `entries` (e,): A_ij; `sums` (n,): A 1, all positive; `trust` (n,): weights of
    the row sums, relative to those of entries: less than 1 where they have lost digits.

    Returns the metric, in units of length in which s = 1, and the root mean square of the equations' residuals:
    cosines, and relative areas.
    """
    equations = _Equations(skeleton, entries, sums, trust)
    metric, c = equations.start()
    if not c:
        return None
    residual = equations.residual(metric, c)
    root = float(np.sqrt(len(residual)))
    damping, patience, history = 1e-2, 25, [float(np.linalg.norm(residual))]
    for step in range(1, 401):
        before = history[-1]
        derivative, by_c = equations.derivative(metric, c)
        moved = None
        while moved is None and damping < 1e8:
            try:
                log_u, log_c = _solved(derivative, by_c, residual, damping)
            except SolverError:
                return None
            wanted = log_u * metric.u
            change = metric.within(wanted, 0.9)
            for reach in 0.4 ** np.arange(5):  # the longest of a step and some shorter ones that lowers the residual
                trial = Metric(skeleton, metric.u + reach * change)
                factor = c * np.exp(np.clip(reach * log_c, -2, 2))
                if np.linalg.norm(trial_residual := equations.residual(trial, factor)) < before:
                    moved = trial, factor, trial_residual
                    break
            else:
                damping *= 8
        if moved is None:
            break
        metric, c, residual = moved
        # A step that no triangle stops calls for less damping; one that many stop, for a little more.
        stopped = float(np.mean(change != wanted))
        damping = max(damping / 10, 1e-14) if not stopped else damping * 1.5 if stopped > HARDLY_ANY else damping
        left = float(np.linalg.norm(residual))
        _log.debug("metric step %d: residual %.1e, stopped %.2g, c %.6g", step, left / root, stopped, c)
        history.append(left)
        if step > patience and left > 0.8 * history[-1 - patience]:
            break
        settled = not stopped and left > 0.5 * before and left < 1e-9 * root
        if left < 1e-15 * root or settled:  # nothing but rounding is left
            break
    return metric, history[-1] / root


def _solved(derivative: sp.csr_array, by_c: NDArray, residual: NDArray, damping: float) -> tuple[NDArray, float]:
    """Damped step of the logarithms of u (e,) and of c; c, which every equation may have, is eliminated."""
    transposed = derivative.T.tocsr()
    normal = sp.csr_array(transposed @ derivative)
    normal = sp.csr_array(normal + sp.diags_array(damping * np.maximum(normal.diagonal(), 1e-8)))
    matrix = UpperTriangle.of(normal)
    factor = factorisation(matrix, definite=True)
    try:
        factor.factorise(matrix)
        coupling = transposed @ by_c
        by_residual, by_scale = factor.solve(np.column_stack([transposed @ residual, coupling])).T
    finally:
        factor.release()
    rest = (1 + damping) * (by_c @ by_c) - coupling @ by_scale
    log_c = -float((by_c @ residual - coupling @ by_residual) / rest)
    return -by_residual - log_c * by_scale, log_c
