"""Sets of nodes put in meshio's order, by where they lie."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from ..budget import AT_ONCE
from ..tolerances import ALIKE
from .boxes import made_round, ordered_boxes
from .kinds import Kind


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
