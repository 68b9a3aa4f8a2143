"""Labels between 0 and 1: cells of fractional strength, from which many wrong labels are put right at once.

With s_k in [0, 1] the weights are w_e = 1/2 sum_k s_k cot_ke, as if the material of candidate k had the conductivity
s_k, and the area form is that of the candidates, each times its s_k: the conformal map is found as ever. There are
more candidates than conditions, and many fractional labels explain the matrix; as wrong labels are few, the sparsest
change is sought:

    minimise  | r - J d - g w - B ds |^2 + lambda sum_k |s_k + ds_k - s0_k|

by least squares with weights lambda / |s_k + ds_k - s0_k| that are adapted in turn, and lambda lowered from one map to
the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import RecoveryError, SolverError
from ..linalg import UpperTriangle, factorisation
from ..planar.cotangent import corner_gradients
from ..planar.krylov import ShiftedSearch
from ..planar.normal import distant_pair
from ..planar.pencil import ConformalPencil
from ..topology.keys import with_sides
from .evidence import LONGEST
from .reading import Reading, fans_of

_PRICE = tuple(1e-2 * 0.4**k for k in range(10))
"""lambda, from one conformal map to the next."""
_SETTLED = 3
"""Rounds after which changes are counted from the nearest whole labels, no more from those of the start."""
_STEADY = 2
"""Rounds without a change of the nearest whole labels that are enough."""
_SMOOTH = (0.5, 0.3, 0.2, 0.1, 0.05, 0.03)
"""Changes below this are not told from none, in the rounds of one linear problem."""
_STEEPEST = 1e5  # cotangents beyond belong to flat triangles
_HELD = 1e-9  # keeps the least-squares problem definite where labels of zero leave vertices free
_SHIFT = 0.7


@dataclass(frozen=True, eq=False)
class _Graph:
    """The edges of all candidates, vanished ones among them; what the pencil needs to know."""

    n_vertices: int
    edges: NDArray[np.int64]

    @property
    def boundary(self) -> NDArray[np.int64]:
        """Every edge, from its lower vertex to the higher one."""
        return self.edges


class Relaxation:
    """Candidates of one drawing, triangulated once.

    Parameters
    ----------
    start : Reading
        Labels to change as few as possible of; its largest piece has positions.
    """

    def __init__(self, start: Reading):
        candidates = self._candidates = start.candidates
        n = candidates.n_vertices
        self._start = start.labels.astype(np.float64)
        self._chosen = (candidates.size <= LONGEST) & ~candidates.outer
        self._triangles, self._cell = fans_of(candidates, self._chosen)
        tails, heads = self._triangles[:, [1, 2, 0]], self._triangles[:, [2, 0, 1]]
        edges, given, self._row = with_sides(n, candidates.edges, self._triangles)
        self._graph = _Graph(n, edges)
        self._sense = np.where(tails < heads, 1.0, -1.0)
        solved = [(piece, mesh) for piece, mesh in zip(start.pieces, start.meshes, strict=True) if mesh]
        self._unit = candidates.scale or max(solved, key=lambda item: item[0].n_vertices)[1].scale
        self._weights = np.zeros(len(edges))  # in these units
        self._weights[given] = candidates.weights / self._unit

    def labels(self) -> NDArray[np.bool_]:
        """Labels that are compatible and cover every edge, after all rounds.

        Raises
        ------
        RecoveryError
            If no conformal map is found on the way.
        """
        strength, z, c = self._start.copy(), np.empty(0), 1.0
        near, labels, same = self._start, self._start > 0.5, 0
        for number, price in enumerate(_PRICE):
            z, c = self._mapped(strength, z, c)
            if number >= _SETTLED:
                near = np.round(strength)
            change = self._change(z, strength, near, c, price)
            if change is None:
                break
            strength[self._chosen] = change
            same = same + 1 if np.array_equal(strength > 0.5, labels) else 0
            if same == _STEADY:
                break
            labels = strength > 0.5
        candidates = self._candidates
        taken = candidates.compatible(np.where(strength > 0.5, strength, -np.inf))
        return candidates.covering(taken, strength)

    def _mapped(self, strength: NDArray, z: NDArray, c: float) -> tuple[NDArray, float]:
        """The conformal map for fractional labels, from the one before."""
        sides = (self._sense * strength[self._cell][:, None]).ravel()
        around = np.bincount(self._row.ravel(), sides, len(self._weights))
        search = ShiftedSearch(ConformalPencil(self._graph, self._weights, around), factorisation, 8)
        if not len(z):
            z = np.random.default_rng(0).standard_normal((self._graph.n_vertices, 2)).view(np.complex128).ravel()
        shift = _SHIFT * c
        for _ in range(4):
            z, c, spread = search.at(shift, z)
            if spread < 1e-9:
                break
            shift = c * (1 - min(max(4 * spread, 1e-6), 0.3))
        return z, c

    def _change(self, z: NDArray, strength: NDArray, near: NDArray, c: float, price: float) -> NDArray | None:
        """New strengths of the chosen candidates."""
        if self._candidates.scale:
            c = 1.0
        before = near[self._chosen]
        current = strength[self._chosen]
        jacobian, response = self._derivatives(z, strength)
        weights = response @ current
        size = np.abs(self._weights / c)
        spread = size + np.median(size[size > 0])
        free = np.ones(2 * len(z), dtype=bool)
        pins = distant_pair(z)
        free[np.r_[2 * pins, 2 * pins + 1]] = False
        scale = weights * (0.0 if self._candidates.scale else 1.0)
        columns = sp.hstack([jacobian[:, free], response, sp.csr_array(scale[:, None])])
        columns = (sp.diags_array(1 / spread) @ columns).tocsr()
        normal = (columns.T @ columns).tocsr()
        rhs = columns.T @ ((self._weights / c - weights) / spread)
        if not (np.isfinite(normal.data).all() and np.isfinite(rhs).all()):
            return None
        labels = slice(int(free.sum()), -1)
        problem = Ridge(normal, rhs, np.full(len(rhs), _HELD))
        away, new = current - before, current
        try:
            for smooth in _SMOOTH:
                pull = price / np.hypot(away, smooth)
                new = np.clip(current + problem.solution(labels, pull, before - current)[labels], 0, 1)
                away = new - before
        except SolverError:
            return None
        finally:
            problem.release()
        return new

    def _derivatives(self, z: NDArray, strength: NDArray) -> tuple[sp.csr_array, sp.csr_array]:
        """Of the weights by positions (e, 2 n), and by the labels of the chosen candidates (e, k)."""
        t, cell = self._triangles, self._cell
        at = z[t]
        u, w = at[:, [1, 2, 0]] - at, at[:, [2, 0, 1]] - at
        product = np.conj(u) * w
        area = np.bincount(cell, product.imag[:, 0], self._candidates.count)
        sense = np.where(area < 0, -1.0, 1.0)[cell][:, None]
        with np.errstate(all="ignore"):
            cotangent = np.clip(np.nan_to_num(sense * product.real / product.imag), -_STEEPEST, _STEEPEST)
            at_u, at_w = (strength[cell][:, None] * sense * g for g in corner_gradients(u, w))
        vertex = np.stack([t, t[:, [1, 2, 0]], t[:, [2, 0, 1]]])
        gradient = np.stack([-at_u - at_w, at_u, at_w])
        gradient[:, ~(np.abs(gradient) < _STEEPEST**2).all(axis=0)] = 0
        row = np.broadcast_to(self._row, vertex.shape)
        shape = (len(self._weights), 2 * len(z))
        jacobian = sp.coo_array(
            (
                np.concatenate([gradient.real.ravel(), -gradient.imag.ravel()]),
                (np.tile(row.ravel(), 2), np.concatenate([2 * vertex.ravel(), 2 * vertex.ravel() + 1])),
            ),
            shape=shape,
        )
        number = np.cumsum(self._chosen) - 1
        response = sp.coo_array(
            (cotangent.ravel() / 2, (self._row.ravel(), np.repeat(number[cell], 3))),
            shape=(shape[0], int(self._chosen.sum())),
        )
        return jacobian.tocsr(), response.tocsr()


class Ridge:
    """Normal equations whose diagonal changes: analysed once.

    Parameters
    ----------
    normal : (k, k) csr_array
    rhs : (k,) float64
    held : (k,) float64
        Added to the diagonal for good.
    """

    def __init__(self, normal: sp.csr_array, rhs: NDArray, held: NDArray):
        upper = sp.triu(normal + sp.diags_array(held), format="csr")
        upper.sort_indices()
        self._upper = UpperTriangle(upper.data, upper.indices, upper.indptr)
        self._rhs = rhs
        self._factor = factorisation(self._upper)

    def solution(self, part: slice, pull: NDArray, target: NDArray) -> NDArray:
        """The minimiser with the further penalty pull |x - target|^2 on a part of the unknowns."""
        data, rhs = self._upper.data.copy(), self._rhs.copy()
        data[self._upper.indptr[:-1][part]] += pull
        rhs[part] += pull * target
        self._factor.factorise(self._upper.with_data(data))
        solution = self._factor.solve(rhs)
        if not np.isfinite(solution).all():
            raise SolverError("the normal equations of the labels are singular")
        return solution

    def release(self) -> None:
        """Give the memory of the factor back."""
        self._factor.release()


def relaxed(start: Reading) -> NDArray[np.bool_] | None:
    """Better labels than those of a reading with many wrong ones; None where none are found."""
    if not any(start.meshes):
        return None
    try:
        return Relaxation(start).labels()
    except RecoveryError:
        return None
