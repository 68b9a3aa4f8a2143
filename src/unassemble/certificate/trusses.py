"""Trusses: blocks of two nodes held against those of bars, and those of nodes by themselves against what bars leave."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..tolerances import LITTLE
from .structures import StructureCheck, determined, touched_by


def check_bars(
    matrix: sp.csr_array,
    node_of_row: NDArray[np.int64],
    direction_of_row: NDArray[np.int64],
    points: NDArray[np.float64],
    *,
    allowed: float,
) -> StructureCheck:
    """Hold the matrix (N, N) of a truss against points (n, d), NaN where a node has none.

    The block of two nodes is that of a bar between them, - k e e^T, whose stiffness k is taken from the block itself.
    What is left of an entry is relative to the largest entry that couples its node to another. By node and not by row,
    since a row across all bars of its node has nothing but their rounding.

    The block of a node by itself is the sum of its bars, k e e^T. What these leave may be a spring to the ground, or
    bars to nodes that are not there: that is positive semidefinite, with the sign of the matrix, and the rows of such a
    node do not count. Anything else is not explained.
    """
    n, d = points.shape
    entry = matrix.tocoo()
    known = determined(points)
    i, j = node_of_row[entry.row], node_of_row[entry.col]
    a, b = direction_of_row[entry.row], direction_of_row[entry.col]
    off = (i != j) & known[i] & known[j] & (a >= 0) & (b >= 0)
    row, i, j, a, b, value = entry.row[off], i[off], j[off], a[off], b[off], entry.data[off]
    counts = np.bincount(row, minlength=len(node_of_row)) > 0
    along = points[i] - points[j]
    length = np.linalg.norm(along, axis=1)
    if (length == 0).any():  # a bar without length has no direction
        return StructureCheck(float("inf"), counts, touched_by(matrix, counts), np.unique(row[length == 0]))
    e = along / length[:, None] if d else along
    bar = np.take_along_axis(e, a[:, None], axis=1)[:, 0] * np.take_along_axis(e, b[:, None], axis=1)[:, 0]
    _, first, pair = np.unique(i * n + j, return_index=True, return_inverse=True)
    weight = np.bincount(pair, bar * bar)
    force = np.bincount(pair, value * bar) / np.where(weight > 0, weight, 1.0)
    size = np.zeros(n)
    np.maximum.at(size, i, np.abs(value))
    left = np.abs(value - force[pair] * bar) / np.where(size[i] > 0, size[i], 1.0)
    worst = np.zeros(len(node_of_row))
    np.maximum.at(worst, row, left)

    # A bar to a node of which few directions are left, and those across it, does not tell its stiffness.
    stiffness = np.where(weight >= LITTLE, -force, 0.0)
    bars = np.zeros((n, d, d))
    np.add.at(bars, i[first], stiffness[:, None, None] * e[first][:, :, None] * e[first][:, None, :])
    wrong, given_back = _own_blocks(matrix, node_of_row, direction_of_row, bars, size, allowed)
    np.maximum.at(worst, np.arange(len(worst)), np.where(counts, wrong, 0.0))
    counts &= given_back
    order = np.argsort(-worst, kind="stable")
    unexplained = order[: np.count_nonzero(worst > allowed)]
    error = float(worst.max(initial=0.0)) if len(row) else float("nan")
    return StructureCheck(error, counts, touched_by(matrix, counts), unexplained)


def _own_blocks(
    matrix: sp.csr_array,
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
    bars: NDArray[np.float64],
    size: NDArray[np.float64],
    allowed: float,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """What `bars` (n, d, d) leave of each node's own block and nothing explains, by row, (N,).

    Where it is more than is `allowed`, that is how far it is from positive semidefinite. Relative to the sizes (n,) of
    nodes, or to a penalty on the diagonal, which is rounded as a whole. With rows (N,) that bars give back.
    """
    n, d, _ = bars.shape
    entry = matrix.tocoo()
    own = (node[entry.row] == node[entry.col]) & (direction[entry.row] >= 0) & (direction[entry.col] >= 0)
    row, column, value = entry.row[own], entry.col[own], entry.data[own]
    there = np.zeros((n, d), dtype=bool)
    there[node[direction >= 0], direction[direction >= 0]] = True
    left = -bars * (there[:, :, None] & there[:, None, :])
    np.add.at(left, (node[row], direction[row], direction[column]), value)
    left *= np.sign(matrix.diagonal().sum())
    left = (left + left.transpose(0, 2, 1)) / 2
    unit = np.where(size > 0, size, 1.0)
    diagonal = np.diagonal(left, axis1=1, axis2=2)
    scale = np.sqrt(np.maximum(unit[:, None], np.abs(diagonal)))
    relative = left / (scale[:, :, None] * scale[:, None, :])
    wrong = np.maximum(-np.linalg.eigvalsh(relative)[:, 0], 0.0) if d else np.zeros(n)

    # What has nothing on the diagonal has nothing beside it, however large the other diagonal entry is.
    across = np.abs(left) / unit[:, None, None]
    across[:, np.arange(d), np.arange(d)] = 0.0
    empty = diagonal <= allowed * unit[:, None]
    beside = np.where(empty[:, :, None] | empty[:, None, :], across, 0.0)
    wrong = np.maximum(wrong, beside.max(axis=(1, 2), initial=0.0))
    rest = (np.abs(left) / unit[:, None, None]).max(axis=2, initial=0.0)
    of_row = np.zeros(len(node))
    told = direction >= 0
    of_row[told] = rest[node[told], direction[told]]
    return np.where(of_row > allowed, wrong[node], of_row), of_row <= allowed
