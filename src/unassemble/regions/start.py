"""Positions to start from: the conformal map of entries in units of the factors on both sides."""

import numpy as np
from numpy.typing import NDArray

from ..boundaries.embedding import relaxed, tutte
from ..boundaries.first import guessed
from ..boundaries.patch import distance
from ..errors import GeometryError, SolverError
from ..planar.conformal import ConformalOptions, conformal_map
from ..planar.cotangent import areas, corner_sides, edge_weights
from ..topology import Piece


def started(
    piece: Piece, weights: NDArray, whole: NDArray[np.bool_], region: NDArray[np.int64], scale: NDArray
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Positions (n,) in which no triangle is turned over, and factors (k,), from what these are about.

    `weights` (e,) are -A_ij, or about that where they are not `whole`, (e,) bool; `region` (m,) those of triangles.
    """
    one, other = region[piece.facing // 3].T
    alike = whole & ((one == other) | ~piece.inner)
    best, fewest, factors = None, len(piece.triangles) / 4, scale
    for _ in range(5):  # each with the factors that fit the one before
        unit = np.where(piece.inner, (factors[one] + factors[other]) / 2, factors[one])
        try:
            found = conformal_map(
                piece, guessed(piece, weights / unit, whole, 1.0), scale=None, sharp=False,
                options=ConformalOptions(max_factorisations=2),
            )  # fmt: skip
        except (GeometryError, SolverError):
            break
        area = areas(piece, found.z)
        z = (found.z if area.sum() > 0 else np.conj(found.z)) / np.sqrt(np.abs(area).mean())
        upright = areas(piece, z) > 0
        drawn = alike & upright[piece.facing // 3].all(axis=1)
        new = _fitted(edge_weights(piece, z), weights, np.where(drawn, one, -1), factors)
        change = np.abs(new / factors - 1).max()
        if (~upright).sum() < fewest:
            best, fewest, scale = z, (~upright).sum(), new
        factors = new
        if change < 1e-3:
            break
    z = None if best is None else _unfolded(piece, best)
    return (tutte(piece, int(np.argmax(np.diff(piece.loop_offsets)))) if z is None else z), scale


def _fitted(drawn: NDArray, weights: NDArray, region: NDArray, scale: NDArray) -> NDArray[np.float64]:
    """Factors (k,) of the weights of each region that make up for most of the entries: least absolute misfits."""
    result = scale.copy()
    for k in range(len(scale)):
        own = (region == k) & np.isfinite(drawn)
        w, a, c = drawn[own], weights[own], scale[k]
        for _ in range(10 * (own.sum() > 2)):
            misfit = np.abs(a - c * w)
            trust = 1 / np.maximum(misfit, 0.1 * np.median(misfit) + 1e-12 * abs(c))
            c = (trust * w) @ a / ((trust * w) @ w)
        result[k] = c if c / scale[k] > 0 else scale[k]
    return result


def _unfolded(piece: Piece, z: NDArray) -> NDArray[np.complex128] | None:
    """The same, vertices about triangles that are turned over being means of their neighbours; None if that fails."""
    for reach in range(1, 7):  # edges
        near = _folded(piece, z)
        if not near.any():
            return z
        free = distance(piece, near, reach) <= reach
        if free.all():
            break
        z = relaxed(piece.edges, z, free)
    return None if _folded(piece, z).any() else z


def _folded(piece: Piece, z: NDArray) -> NDArray[np.bool_]:
    """(n,) vertices of triangles that are turned over, and those inside around which triangles go more than once."""
    after, before = corner_sides(piece.triangles, z)
    angle = np.angle(before * np.conj(after))
    around = np.bincount(piece.triangles.ravel(), angle.ravel(), piece.n_vertices)
    folded = np.abs(around - 2 * np.pi) > 1
    folded[piece.boundary] = False
    folded[piece.triangles[areas(piece, z) <= 0]] = True
    return folded
