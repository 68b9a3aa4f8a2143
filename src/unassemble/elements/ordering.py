"""Sets of nodes put in meshio's order, by where they lie."""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from ..budget import AT_ONCE
from ..tolerances import ALIKE
from .kinds import Kind

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


def ordered(sets: NDArray[np.int64], points: NDArray[np.float64], kind: Kind) -> NDArray[np.int64]:
    """Cells of a kind on given sets of nodes, (m, k), positively oriented; flat simplices are left out.

    Corners are the nodes farthest out, seen after the linear map that makes the cell round. Where that leaves
    further nodes off the middles of straight sides, the nodes that are no middles of others are tried as corners.
    """
    far, outermost = np.linalg.norm(made_round(points[sets]), axis=2), np.zeros(sets.shape, dtype=bool)
    np.put_along_axis(outermost, np.argsort(-far, axis=1, kind="stable")[:, : kind.corners], True, axis=1)
    cells, misfit = _arranged(sets, outermost, points, kind)
    if kind.quadratic and (misfit > ALIKE).any():
        poor = np.flatnonzero(misfit > ALIKE)
        corners = _no_middles(sets[poor], points, kind.corners)
        again = poor[corners.any(axis=1)]
        other, second = _arranged(sets[again], corners[corners.any(axis=1)], points, kind)
        better = second < misfit[again]
        cells[again[better]] = other[better]
    return cells[cells[:, 0] >= 0]


def _no_middles(sets: NDArray, points: NDArray, corners: int) -> NDArray[np.bool_]:
    """(m, k) nodes that are in the middle of no two others of their set; none where these are not the corners."""
    chosen = np.zeros(sets.shape, dtype=bool)
    step = max(AT_ONCE // sets.shape[1] ** 2, 1)
    for start in range(0, len(sets), step):
        x = points[sets[start : start + step]]
        size = np.ptp(x, axis=1).max(axis=1)[:, None]
        for a in range(sets.shape[1]):
            across = 2 * x[:, a : a + 1] - x  # where the other end would be
            distance = np.linalg.norm(across[:, :, None] - x[:, None], axis=3)
            distance[:, a, a] = np.inf
            chosen[start : start + step, a] = (distance.min(axis=2) > ALIKE * size).all(axis=1)
    chosen[chosen.sum(axis=1) != corners] = False
    return chosen


def _arranged(
    sets: NDArray, corners: NDArray[np.bool_], points: NDArray, kind: Kind
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Cells on given corners, -1 first if flat, and how far a node is from the middle of its corners, over the size."""
    m = len(sets)
    frame = sets[corners].reshape(m, kind.corners)
    frame = _oriented(frame, points) if kind.simplex else ordered_boxes(frame, points)
    if not kind.quadratic:
        return frame, np.zeros(m)
    further = sets[~corners].reshape(m, len(kind.between))
    x, y = points[np.maximum(frame, 0)], points[further]
    predicted = np.stack([x[:, list(some)].mean(axis=1) for some in kind.between], axis=1)
    order = np.empty(further.shape, np.int64)
    misfit = np.empty(m)
    step = max(AT_ONCE // further.shape[1] ** 2, 1)
    for start in range(0, m, step):
        part = slice(start, start + step)
        distance = np.linalg.norm(predicted[part][:, :, None] - y[part][:, None], axis=3)
        order[part] = distance.argmin(axis=2)
        for odd in np.flatnonzero((np.sort(order[part], axis=1) != np.arange(further.shape[1])).any(axis=1)):
            order[start + odd] = linear_sum_assignment(np.nan_to_num(distance[odd]))[1]  # flat frames have none
        misfit[part] = np.take_along_axis(distance, order[part][:, :, None], axis=2).max(axis=(1, 2))
    cells = np.column_stack([frame, np.take_along_axis(further, order, axis=1)])
    return cells, misfit / np.ptp(points[sets], axis=1).max(axis=1, initial=1e-300)


def _oriented(cells: NDArray[np.int64], points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Positive simplices; flat ones become -1."""
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    volume = np.linalg.det(edges)
    size = np.linalg.norm(edges, axis=2).max(axis=1, initial=0) ** points.shape[1]
    cells = cells.copy()
    cells[volume < 0, -2:] = cells[volume < 0, -1:-3:-1]
    cells[np.abs(volume) <= 1e-9 * size] = -1
    return cells
