"""Corners of quadrilaterals and hexahedra put in meshio's order, by where they lie."""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..tolerances import ALIKE

_NEAR = 0.25  # squared distance of a cell of about unit size from an affine box; wrong orders are three times as far


def ordered_boxes(cells: NDArray[np.int64], points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Put the corners of each cell in meshio's order, positively oriented.

    Each choice of d corners as neighbours of the first gives a frame, in which the signs of the coordinates from the
    centre tell which corner of a box is which. The affine map that takes these corners nearest to the cell's gives a
    better frame. Of the choices that find each corner once the one wins whose box the cell is nearest to.
    """
    m, corners = cells.shape
    d = points.shape[1]
    x = made_round(points[cells])
    bits = (np.arange(corners)[:, None] >> np.arange(d)) & 1
    design = np.column_stack([np.ones(corners), bits - 0.5])
    affine = np.linalg.pinv(design)
    best = np.full(m, np.inf)
    order = np.zeros((m, corners), dtype=np.int64)
    for choice in combinations(range(1, corners), d):
        open_cells = np.flatnonzero(best > _NEAR)
        y = x[open_cells]
        corner = _corners_in(y[:, choice, :] - y[:, :1], y)
        found = design[corner]
        moment = found.transpose(0, 2, 1) @ found + ALIKE * np.eye(d + 1)
        corner = _corners_in(np.linalg.solve(moment, found.transpose(0, 2, 1) @ y)[:, 1:], y)
        trial = np.argsort(corner, axis=1)
        y = np.take_along_axis(y, trial[:, :, None], axis=1)
        misfit = ((y - design @ (affine @ y)) ** 2).sum(axis=(1, 2))
        misfit[(np.sort(corner, axis=1) != np.arange(corners)).any(axis=1)] = np.inf
        better = misfit < best[open_cells]
        best[open_cells[better]], order[open_cells[better]] = misfit[better], trial[better]
    cube = np.take_along_axis(cells, order, axis=1)
    mirrored = np.linalg.det((affine @ points[cube])[:, 1:]) < 0
    swapped = cube.copy()
    exchange = ((np.arange(corners) & 1) << 1) | ((np.arange(corners) >> 1) & 1) | (np.arange(corners) & ~3)
    swapped[mirrored] = cube[mirrored][:, exchange]
    ring = [0, 1, 3, 2] if d == 2 else [0, 1, 3, 2, 4, 5, 7, 6]
    return swapped[:, ring]


def _corners_in(frame: NDArray, x: NDArray) -> NDArray[np.int64]:
    """(m, k) which corner of a box along the axes of a frame (m, d, d) each of the points (m, k, d) is nearest to."""
    d = x.shape[2]
    frame = np.where((np.abs(np.linalg.det(frame)) < ALIKE)[:, None, None], np.eye(d), frame)
    return ((x @ np.linalg.inv(frame) > 0) << np.arange(d)).sum(axis=2)


def made_round(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners of each cell (m, k, d) after the linear map that makes their covariance the identity: nearly a cube."""
    centred = x - x.mean(axis=1, keepdims=True)
    value, vector = np.linalg.eigh(np.einsum("mka,mkb->mab", centred, centred))
    value = np.maximum(np.maximum(value, 1e-12 * value[:, -1:]), np.finfo(float).tiny)  # corners may all be one point
    return np.einsum("mka,mab->mkb", centred, vector / np.sqrt(value)[:, None, :])
