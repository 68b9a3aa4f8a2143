"""Candidates of one embedding as one elastic sheet: weights, and their derivatives, for labels between 0 and 1.

With a strength s_k in [0, 1] for each candidate the weights are w_e = 1/2 sum_k s_k cot_ke, as if the material of
candidate k had the conductivity s_k, and the area form is that of the candidates, each times its s_k: the conformal
map is found as ever.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...linalg import solved
from ...planar.cotangent import corner_gradients, cotangent
from ...planar.normal import distant_pair
from ...planar.pencil import ConformalPencil, ShiftedSearch
from ...planar.piece import PieceMesh
from ...topology.keys import with_sides
from ..candidates.candidates import Candidates

STEEPEST = 1e5
"""Cotangents beyond belong to flat triangles."""


class Sheet:
    """Candidates of one embedding, triangulated once.

    `unit`: a guess of c, in units of which its maps have their scales; `chosen` (cells,): candidates that may be cells,
    all that can be unless given.
    """

    def __init__(self, candidates: Candidates, unit: float, chosen: NDArray[np.bool_] | None = None):
        self.candidates = candidates
        self.n_vertices = n = candidates.n_vertices
        # (cells,) candidates that can be cells, k of them: these have triangles, (m, 3), of the candidates `cell`, (m,)
        self.chosen = (candidates.cells.size <= 40) & ~candidates.outer if chosen is None else chosen
        triangles, cell, _ = candidates.cells.fans()
        self.triangles, self.cell = triangles[self.chosen[cell]], cell[self.chosen[cell]]
        # (e, 2) edges of the graph and of the triangles, and (m, 3) the rows of those that face the corners
        self.edges, given, self.row = with_sides(n, candidates.edges, self.triangles)
        tails, heads = self.triangles[:, [1, 2, 0]], self.triangles[:, [2, 0, 1]]
        self._sense = np.where(tails < heads, 1.0, -1.0)
        self.free_scale = candidates.scale is None
        # (e,) -A_ij in units of the guess, zero for edges that the graph does not have; and their median size
        self.weights = np.zeros(len(self.edges))
        self.weights[given] = candidates.weights / unit
        self.typical = float(np.median(np.abs(self.weights[given][candidates.weights != 0])))

    def spread(self, c: float) -> NDArray[np.float64]:
        """(e,) by which misfits are divided."""
        return np.asarray((np.abs(self.weights) + self.typical) / c)

    def misfit(self, placed: PieceMesh, strength: NDArray) -> NDArray[np.float64]:
        """(e,) what is left of the weights, divided by their spread."""
        halves = strength[self.cell][:, None] * self.cotangents(placed.z[self.triangles]) / 2
        w = np.bincount(self.row.ravel(), halves.ravel(), len(self.weights))
        return np.asarray((self.weights / placed.scale - w) / self.spread(placed.scale))

    @staticmethod
    def cotangents(at: NDArray) -> NDArray[np.float64]:
        """(m, 3) cotangents at the corners of triangles, (m, 3) complex."""
        with np.errstate(all="ignore"):
            found = cotangent(at[:, [1, 2, 0]] - at, at[:, [2, 0, 1]] - at)
        return np.clip(np.nan_to_num(found, posinf=STEEPEST, neginf=-STEEPEST), -STEEPEST, STEEPEST)

    def around(self, strength: NDArray) -> NDArray[np.float64]:
        """(e,) the boundary of all candidates, each times its strength: as whole labels have it, so is their map."""
        sides = (self._sense * strength[self.cell][:, None]).ravel()
        return np.asarray(np.bincount(self.row.ravel(), sides, len(self.weights)), dtype=np.float64)

    def pencil(self, strength: NDArray) -> ConformalPencil:
        """The conformal pencil for fractional labels, of weights over some c; each edge may be on the boundary."""
        return ConformalPencil(self.n_vertices, self.edges, self.edges, self.weights, self.around(strength))

    def mapped(self, strength: NDArray, start: PieceMesh | None = None) -> PieceMesh:
        """The conformal map for fractional labels; raises RecoveryError if there is none."""
        search = ShiftedSearch(self.pencil(strength), 8)
        noise = np.random.default_rng(0).standard_normal((self.n_vertices, 2)).view(np.complex128).ravel()
        z, c = (start.z, start.scale) if start else (noise, 1.0)
        shift = 0.7 * c
        for _ in range(4):
            z, c, spread = search.at(shift, z)
            if spread < 1e-9:
                break
            shift = c * (1 - min(max(4 * spread, 1e-6), 0.3))
        return PieceMesh(z, c if self.free_scale else 1.0)

    def label_step(
        self, placed: PieceMesh, strength: NDArray, which: NDArray, trust: NDArray, held: NDArray, pull: NDArray | float
    ) -> NDArray[np.float64]:
        """Changes of some labels that explain the misfit best, to first order, with displacements and a change of c.

        `which` (k,): candidates; `trust` (e,): weights of the misfit; `held` (k,): weights of the squares of changes;
        `pull` (k,): half the slope of what else is minimised, downwards. Raises RecoveryError where there is no step.
        """
        t, z, e = self.triangles, placed.z, len(self.weights)
        at = z[t]
        with np.errstate(all="ignore"):
            at_u, at_w = corner_gradients(at[:, [1, 2, 0]] - at, at[:, [2, 0, 1]] - at)
        gradient = np.stack([-at_u - at_w, at_u, at_w])  # by the corner itself, the next one and the one after
        gradient[:, ~(np.abs(gradient) < STEEPEST**2).all(axis=0)] = 0
        gradient *= strength[self.cell][:, None]
        vertex = 2 * np.stack([t, t[:, [1, 2, 0]], t[:, [2, 0, 1]]]).ravel()
        row = np.tile(self.row.ravel(), 6)
        by_position = sp.coo_array(
            (np.r_[gradient.real.ravel(), -gradient.imag.ravel()], (row, np.r_[vertex, vertex + 1])), (e, 2 * len(z))
        )
        by_label = sp.coo_array(
            (self.cotangents(at).ravel() / 2, (self.row.ravel(), np.repeat(self.cell, 3))), (e, len(strength))
        ).tocsc()
        free = np.ones(2 * len(z), dtype=bool)
        free[2 * distant_pair(z)[:, None] + [0, 1]] = False
        by_scale = sp.csc_array((by_label @ strength)[:, None] * (1.0 if self.free_scale else 0.0))
        columns = sp.diags_array(1 / self.spread(placed.scale)) @ sp.hstack(
            [by_position.tocsc()[:, free], by_scale, by_label[:, which]]
        )
        loose = np.full(int(free.sum()) + 1, 1e-9 * trust.max())  # labels of zero leave vertices free
        loose[-1] += 0.0 if self.free_scale else 1.0
        weighted = columns.T @ sp.diags_array(trust)
        rhs = weighted @ self.misfit(placed, strength)
        rhs[len(loose) :] += pull
        return solved((weighted @ columns + sp.diags_array(np.append(loose, held))).tocsr(), rhs)[len(loose) :]
