"""Areas of triangles from the entries of c L + s M: squared lengths of all edges, and c, by Levenberg-Marquardt.

In units of length in which s = 1, with w the weights of the Laplacian and a the areas, -A_ij = c w_ij - (sum of a over
the triangles of ij) / 12, and (A 1)_i = (sum of a over the triangles at i) / 3: e + n equations for e + 1 unknowns, and
local, so that some seven steps do at any number of vertices. The weights of a triangle with small angles are inversely
proportional to its area; what is compared is 2 w / sqrt(1 + 4 w^2), for a single triangle the cosine of the angle,
which is linear in the square of the side that faces it: no step overshoots there.
"""

import logging
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import SolverError
from ..linalg import solved
from ..metric.heron import areas_cotangents, blocks_of, longest_step, summed
from ..tolerances import HARDLY_ANY
from .cells import incidence

_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class _Equations:
    """Entries (e,) of edges (e, 2), row sums (n,), all positive, and weights of the latter (n,)."""

    edges: NDArray[np.int64]
    opposite: NDArray[np.int64]  # (m, 3) the edge that faces each corner
    entries: NDArray[np.float64]
    sums: NDArray[np.float64]
    trust: NDArray[np.float64]
    at_edges: sp.csr_array  # (e, m)
    at_vertices: sp.csr_array  # (n, m)

    def residual(self, u: NDArray, c: float) -> NDArray[np.float64]:
        """(e + n,) cosines given minus fitted, and row sums fitted over given, minus one."""
        _, area, _, _, given, fitted = self._at(u, c)
        cosines = given / np.hypot(1, given) - fitted / np.hypot(1, fitted)
        return np.concatenate([cosines, self.trust * (self.at_vertices @ area / (3 * self.sums) - 1)])

    def derivative(self, u: NDArray, c: float) -> tuple[sp.csr_array, NDArray[np.float64]]:
        """(e + n, e) by the logarithms of u, and (e + n,) by that of c."""
        own, area, cotangents, unit, given, fitted = self._at(u, c)
        e, m, ones = len(u), len(own), np.ones(len(own))
        blocks = -2 * blocks_of(own, area, cotangents, ones, -ones) / own[:, :, None]
        place = np.repeat(self.opposite, 3, axis=1).ravel(), np.tile(self.opposite, (1, 3)).ravel()
        of_weights = sp.csr_array((blocks.ravel(), place), shape=(e, e))
        place = np.repeat(np.arange(m), 3), self.opposite.ravel()
        of_areas = sp.csr_array(((own * cotangents / 4).ravel(), place), shape=(m, e))
        slope, slope_fitted = ((1 + x**2) ** -1.5 for x in (given, fitted))
        cosines = sp.diags_array(slope * unit / (12 * c)) @ (self.at_edges @ of_areas)
        cosines = cosines - sp.diags_array(slope_fitted * unit) @ of_weights
        sums = sp.diags_array(self.trust / (3 * self.sums)) @ (self.at_vertices @ of_areas)
        return sp.csr_array(sp.vstack([cosines, sums])), np.concatenate([-slope * given, np.zeros(len(self.sums))])

    def _at(self, u: NDArray, c: float) -> tuple[NDArray, ...]:
        """(m, 3) u of sides, (m,) areas, (m, 3) cotangents, (e,) a unit, (e,) weights given and fitted, in this unit.

        For 60 degrees weights are about 1 then; less where masses of the entry's size change more.
        """
        own = u[self.opposite]
        area, cotangents = areas_cotangents(own)
        of_mass = (self.sums / self.at_vertices.sum(axis=1))[self.edges].mean(axis=1) / 4
        unit = 2 / self.at_edges.sum(axis=1) * abs(c) / (abs(c) + of_mass)
        given, fitted = (self.at_edges @ area / 12 - self.entries) / c, summed(self.opposite, cotangents / 2, len(u))
        return own, area, cotangents, unit, unit * given, unit * fitted

    def start(self) -> tuple[NDArray[np.float64], float]:
        """Circles about the vertices whose neighbours touch: they have triangles, and sizes from the row sums."""
        radius = np.sqrt(self.sums / self.at_vertices.sum(axis=1) * np.sqrt(3))  # of equilateral triangles
        u = radius[self.edges].sum(axis=1) ** 2
        *_, given, fitted = self._at(u, 1.0)
        return u, float(np.sign(np.median(given / fitted)) * np.median(np.abs(given / fitted)))

    def within(self, u: NDArray, change: NDArray) -> NDArray[np.float64]:
        """(e,) a change of u (e,), less at the edges of triangles that it would make flat: these hold up no others."""
        share = np.ones(len(u))
        part = 0.9 * longest_step(u[self.opposite], change[self.opposite])
        np.minimum.at(share, self.opposite.ravel(), np.repeat(part, 3))
        change = share * change
        return change * min(1.0, 0.9 * longest_step(u[self.opposite], change[self.opposite]).min())


@np.errstate(all="ignore")  # of a misfit that is not finite nothing comes
def fit_areas(
    edges: NDArray, triangles: NDArray, opposite: NDArray, entries: NDArray, sums: NDArray, trust: NDArray
) -> tuple[NDArray[np.float64], NDArray[np.float64], float] | None:
    """Areas with which a mesh has these entries, c being any; None where the iteration breaks down.

    `edges` (e, 2): all at triangles; `triangles`, `opposite` (m, 3): vertices, and the edges that face them; `entries`
    (e,): A_ij; `sums` (n,): A 1, all positive; `trust` (n,): weights of the row sums, relative to those of entries:
    less than 1 where they have lost digits.

    Returns areas (m,) and squared lengths (e,), in units in which s = 1, and the root mean square of the equations'
    residuals: cosines, and relative areas.
    """
    at_edges, at_vertices = incidence(opposite, len(edges)), incidence(triangles, len(sums))
    equations = _Equations(edges, opposite, entries, sums, trust, at_edges, at_vertices)
    u, c = equations.start()
    if not c:
        return None
    residual = equations.residual(u, c)
    root, patience = float(np.sqrt(len(residual))), 25
    damping, history = 1e-2, [float(np.linalg.norm(residual))]
    derivative = equations.derivative(u, c)
    while damping < 1e8 and len(history) <= 400:
        try:
            log_u, log_c = _solved(*derivative, residual, damping)
        except SolverError:
            return None
        before, wanted = history[-1], log_u * u
        change = equations.within(u, wanted)
        for reach in 0.4 ** np.arange(5):  # the longest of a step and some shorter ones that lowers the residual
            trial = u + reach * change, c * np.exp(np.clip(reach * log_c, -2, 2))
            left = float(np.linalg.norm(moved := equations.residual(*trial)))
            if left < before:
                break
        else:
            damping *= 8
            continue
        (u, c), residual = trial, moved
        derivative = equations.derivative(u, c)
        history.append(left)
        # A step that no triangle stops calls for less damping; one that many stop, for a little more.
        stopped = float(np.mean(change != wanted))
        damping = max(damping / 10, 1e-14) if not stopped else damping * 1.5 if stopped > HARDLY_ANY else damping
        _log.debug("metric step %d: residual %.1e, stopped %.2g, c %.6g", len(history), left / root, stopped, c)
        settled = not stopped and left > 0.5 * before and left < 1e-9 * root
        if left < 1e-15 * root or settled or left > 0.8 * ([np.inf] * patience + history)[-1 - patience]:
            break
    return areas_cotangents(u[opposite])[0], u, history[-1] / root


def _solved(derivative: sp.csr_array, by_c: NDArray, residual: NDArray, damping: float) -> tuple[NDArray, float]:
    """Damped step of the logarithms of u (e,) and of c; c, which every equation may have, is eliminated."""
    transposed = derivative.T.tocsr()
    normal = sp.csr_array(transposed @ derivative)
    normal = sp.csr_array(normal + sp.diags_array(damping * np.maximum(normal.diagonal(), 1e-8)))
    coupling = transposed @ by_c
    by_residual, by_scale = solved(normal, np.column_stack([transposed @ residual, coupling])).T
    rest = (1 + damping) * (by_c @ by_c) - coupling @ by_scale
    log_c = -float((by_c @ residual - coupling @ by_residual) / rest)
    return -by_residual - log_c * by_scale, log_c
