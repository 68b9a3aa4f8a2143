"""Coordinates in space for given edge lengths: least squares from several starts, one shape of possibly many."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.sparse import csgraph

from ..clock import Clock
from ..recovery import Surface
from ..tolerances import CERTIFIED
from ..topology.numbering import connected


def realised(surface: Surface, clock: Clock, starts: int = 4) -> Surface:
    """The surface with coordinates that minimise the misfit of squared edge lengths, and with what is left of it.

    Lengths do not determine a shape: surfaces that are open mostly bend, and those that do not may have several shapes,
    mirror images of parts for one. What has the edge lengths up to rounding is a shape of this surface, perhaps not the
    one that the matrix came from; where a misfit is left none was found.
    """
    with clock("realise"):
        points = np.full((surface.n_points, 3), np.nan)
        known = np.isfinite(surface.edge_lengths)
        _, part = connected(surface.n_points, *surface.edges.T)
        per_start: NDArray[np.float64] = np.zeros((starts, len(surface.edges)))
        for label in np.unique(part[surface.edges[known, 0]]):
            rows = np.flatnonzero(known & (part[surface.edges[:, 0]] == label))
            vertices, local = np.unique(surface.edges[rows], return_inverse=True)
            edges, lengths = local.reshape(-1, 2), surface.edge_lengths[rows]
            shapes = [_fitted(start, edges, lengths) for start in _starts(len(vertices), edges, lengths, starts)]
            left = [_lengths(shape, edges) - lengths for shape in shapes]
            per_start[:, rows] = left
            misfits = np.linalg.norm(left, axis=1) / np.linalg.norm(lengths)
            # Dents make a shape smaller, and fit as well.
            fitting = np.flatnonzero(misfits <= max(float(misfits.min()), CERTIFIED))
            best = shapes[max(fitting, key=lambda k: float(np.var(shapes[k], axis=0).sum()))]
            centred = best - best.mean(axis=0)
            points[vertices] = centred @ np.linalg.svd(centred, full_matrices=False)[2].T  # in principal axes
    misfit = _lengths(points, surface.edges)[known] - surface.edge_lengths[known]
    found = {
        "misfit": float(np.sqrt(np.mean(misfit**2))),
        "largest": float(np.abs(misfit).max(initial=0.0)),
        "misfits": [float(np.sqrt(np.mean(one[known] ** 2))) for one in per_start],
    }
    return replace(surface, points=points, realisation=found)


def _lengths(points: NDArray, edges: NDArray) -> NDArray[np.float64]:
    return np.asarray(np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1))


def _starts(n: int, edges: NDArray, lengths: NDArray, count: int) -> list[NDArray[np.float64]]:
    """Landmark multidimensional scaling of distances along edges, and the same with distances bent and noise.

    Distances along a surface are longer than those through space, the more so the longer they are.
    """
    graph = sp.coo_array((lengths, edges.T), shape=(n, n)).tocsr()
    rng = np.random.default_rng(0)
    marks = [0]
    far = np.full(n, np.inf)
    distances = []
    for _ in range(min(n, 60)):
        distances.append(csgraph.dijkstra(graph, directed=False, indices=marks[-1]))
        far = np.minimum(far, distances[-1])
        marks.append(int(np.argmax(far)))
    table = np.array(distances)
    starts = []
    for k in range(count):
        square = (table ** (1 - 0.15 * k)) ** 2
        own = square[:, marks[: len(table)]]
        centre = own.mean(axis=1)
        value, vector = np.linalg.eigh(-0.5 * (own - centre[:, None] - centre + own.mean()))
        top = np.argsort(-value)[:3]
        axes = vector[:, top] / np.sqrt(np.maximum(value[top], 1e-12 * value.max()))
        start = -0.5 * (square - centre[:, None]).T @ axes
        start += 0.05 * rng.standard_normal(start.shape)  # of a mean edge: nothing stays flat, or in one place
        now = _lengths(start, edges)
        starts.append(start * float((now @ lengths) / (now @ now)))
    return starts


def _fitted(start: NDArray, edges: NDArray, lengths: NDArray) -> NDArray[np.float64]:
    """Least squares of (|x_i - x_j|^2 - l^2) / 2 l."""
    rows = np.repeat(np.arange(len(edges)), 6)
    columns = (3 * edges[:, :, None] + np.arange(3)).reshape(len(edges), 6).ravel()

    def side(x: NDArray) -> NDArray[np.float64]:
        return x.reshape(-1, 3)[edges[:, 0]] - x.reshape(-1, 3)[edges[:, 1]]

    def residual(x: NDArray) -> NDArray[np.float64]:
        return ((side(x) ** 2).sum(axis=1) - lengths**2) / (2 * lengths)

    def jacobian(x: NDArray) -> sp.csr_array:
        unit = side(x) / lengths[:, None]
        return sp.csr_array((np.hstack([unit, -unit]).ravel(), (rows, columns)), shape=(len(edges), start.size))

    found = least_squares(residual, start.ravel(), jacobian, ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=80)
    return np.asarray(found.x).reshape(-1, 3)
