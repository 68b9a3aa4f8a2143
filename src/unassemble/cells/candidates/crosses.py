"""Vertices with four right angles about them, known by their numbers alone.

Let h have four neighbours and a right triangle between each of them and the next. The edge to the k-th, of length r_k,
has the weight (r_k-1 + r_k+1) / 2 r_k, in units of c. With u = 1 / w, and 1 opposite 3,

    (u_1 + u_3) (u_2 + u_4) = 4 / c^2,

so that the numbers say which edges are opposite to each other wherever c is known, or many such vertices agree in it.
Right triangles that are halves of rectangles are no exception.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...topology.adjacency import adjacency
from ...topology.keys import pair_keys
from ..agreement import common_values

_AGREE = 1e-7
_SIGMAS = 6.0  # errors of c by which crosses may differ
_OPPOSITE = np.array([[0, 1, 2, 3], [0, 1, 3, 2], [0, 2, 1, 3]])
"""Cyclic orders of four neighbours: first opposite third, second opposite fourth."""


@dataclass(frozen=True, eq=False)
class Crosses:
    """Vertices whose entries are those of four right angles.

    Attributes
    ----------
    scale : float or None
        The c in which they agree; None without any.
    hub : (k,) int64
    order : (k, 4) int64
        Neighbours in cyclic order.
    unique : (k,) bool
        Whether no other order fits as well.
    """

    scale: float | None
    hub: NDArray[np.int64]
    order: NDArray[np.int64]
    unique: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        n: int,
        edges: NDArray,
        weights: NDArray,
        scale: float | None = None,
        errors: NDArray | None = None,
    ) -> Crosses:
        """Find them all.

        Parameters
        ----------
        n : int
        edges : (e, 2) int64
            Pairs i < j in lexicographic order.
        weights : (e,) float64
            -A_ij of each edge.
        scale : float, optional
            c, where it is known.
        errors : (e,) float64, optional
            Standard deviations of the errors of the weights, where they are known.
        """
        graph = adjacency(n, edges)
        hub = np.flatnonzero(np.diff(graph.indptr) == 4)
        near = graph.indices[graph.indptr[hub][:, None] + np.arange(4)].astype(np.int64)
        key = np.minimum(near, hub[:, None]) * n + np.maximum(near, hub[:, None])
        row = np.searchsorted(edges[:, 0] * n + edges[:, 1], key)
        w = weights[row]
        sign = np.sign(weights.sum())
        usable = (w * sign > 0).all(axis=1)
        hub, near, row, w = hub[usable], near[usable], row[usable], w[usable]
        u = (1 / w)[:, _OPPOSITE]
        sums = u[..., :2] + u[..., 2:]
        factors = 2 * sign / np.sqrt(sums.prod(axis=-1))
        agree = np.full(factors.shape, _AGREE)
        if errors is not None:
            of_sums = np.hypot(*np.split(u**2 * errors[row][:, _OPPOSITE], 2, axis=-1)) / sums
            agree = np.maximum(agree, _SIGMAS / 2 * np.hypot(*np.moveaxis(of_sums, -1, 0)))
        if scale is None:
            typical = float(np.median(agree)) if agree.size else _AGREE
            common = common_values(factors.ravel(), np.repeat(np.arange(len(factors)), 3), typical)
            if not len(common):
                return cls(None, np.empty(0, np.int64), np.empty((0, 4), np.int64), np.empty(0, bool))
            scale = float(common[0])
        fits = np.abs(factors / scale - 1) < agree
        kept = fits.any(axis=1)
        order = np.take_along_axis(near[kept], _OPPOSITE[fits[kept].argmax(axis=1)], axis=1)
        return cls(scale, hub[kept], order, fits[kept].sum(axis=1) == 1)

    @property
    def wedges(self) -> NDArray[np.int64]:
        """(k, 3) corners a-h-b of those with one order."""
        order, hub = self.order[self.unique], self.hub[self.unique]
        return np.concatenate(
            [np.column_stack([order[:, k], hub, order[:, (k + 1) % 4]]) for k in range(4)], dtype=np.int64
        )

    def cotangents(self, n: int, edges: NDArray, weights: NDArray) -> NDArray[np.float64]:
        """(e, 4) of the angles that face each edge about the crosses at both of its ends; NaN for none.

        From w_k = (r_k-1 + r_k+1) / 2 r_k the legs follow up to a common factor.
        """
        result = np.full((len(edges), 4), np.nan)
        if self.scale is None:
            return result
        hub, order = self.hub[self.unique, None], self.order[self.unique]
        row = np.searchsorted(edges[:, 0] * n + edges[:, 1], pair_keys(n, hub, order))
        w = weights[row].T / self.scale
        first = 2 * w[1] / (1 + w[0] / w[2])
        leg = np.stack([first, np.ones_like(first), first * w[0] / w[2], w[1] / w[3]], axis=1)
        column = 2 * (edges[row, 1] == hub)
        result[row, column] = np.roll(leg, -1, axis=1) / leg
        result[row, column + 1] = np.roll(leg, 1, axis=1) / leg
        return result
