"""Supports, orders of the unknowns and storage, in every combination, and a judge who knows the truth."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np
import scipy.sparse as sp
from assembled import Assembled, on_plane, recover_elasticity

SUPPORTS = (
    "free", "clamp", "roller", "symmetry", "identity clamp", "identity rollers", "penalty clamp", "penalty rollers",
    "several",
)  # fmt: skip
ORDERS = ("interleaved", "by component", "boundary first", "boundary first by component", "at random")
ZEROS = ("stored", "dropped")


@dataclass(frozen=True)
class Given:
    """A matrix as it would be handed over, and the truth: node and direction of each row, points of all nodes."""

    matrix: sp.csr_array
    node: np.ndarray
    direction: np.ndarray
    points: np.ndarray


def given(case: Assembled, support: str, order: str, zeros: str, seed: int = 0) -> Given:
    """Hold a body, put its rows in order, and store zeros or not.

    Clamps hold all directions on the plane x = 0; rollers x there, and symmetry is rollers on the first planes across
    all axes. Several: x = 0 clamped and eliminated, y eliminated on y = 0 and replaced by the identity on y = 1, and a
    penalty on all directions at x = 1. Boundary first: the nodes on the sides of a box come before all others, as mesh
    generators number them.
    """
    n, d = case.points.shape
    held = np.zeros((n, d), dtype=bool)
    held[on_plane(case, 0), 0] = True
    if support.endswith("clamp"):
        held[on_plane(case, 0)] = True
    if support.endswith(("symmetry", "rollers")):
        for axis in range(d):
            held[on_plane(case, axis), axis] = True
    gone, identity, penalty = np.zeros((3, n, d), dtype=bool)
    if support.startswith("identity"):
        identity = held
    elif support.startswith("penalty"):
        penalty = held
    elif support == "several":
        gone[on_plane(case, 0)] = True
        gone[on_plane(case, 1), 1] = True
        identity[on_plane(case, 1, 1.0), 1] = True
        penalty[on_plane(case, 0, 1.0)] = True
    elif support != "free":
        gone = held
    matrix = with_zeros(case.matrix, d, zeros).tocoo()
    lost, held_fast = identity.ravel(), penalty.ravel()
    entries = np.where(lost[matrix.row] | lost[matrix.col], 0.0, matrix.data)
    stiff = 1e10 * np.abs(entries).max()
    entries = entries + (matrix.row == matrix.col) * (lost + stiff * held_fast)[matrix.row]
    matrix = sp.csr_array((entries, (matrix.row, matrix.col)), shape=matrix.shape)
    if zeros == "dropped":
        matrix.eliminate_zeros()
    rows = np.flatnonzero(~gone.ravel())
    if order.startswith("boundary first"):
        inside = ((case.points > case.points.min(axis=0)) & (case.points < case.points.max(axis=0))).all(axis=1)
        rows = rows[np.argsort(inside[rows // d], kind="stable")]
    if order.endswith("by component"):
        rows = rows[np.argsort(rows % d, kind="stable")]
    elif order == "at random":
        rows = rows[np.random.default_rng(seed).permutation(len(rows))]
    return Given(sp.csr_array(matrix[rows][:, rows]), rows // d, rows % d, case.points)


def with_zeros(matrix: sp.csr_array, d: int, zeros: str) -> sp.csr_array:
    """Store full blocks, as most codes do, or nothing that is zero but for rounding."""
    if zeros == "dropped":
        matrix = matrix.copy()
        matrix.data[np.abs(matrix.data) < 1e-13 * np.abs(matrix.data).max()] = 0
        matrix.eliminate_zeros()
        return matrix
    blocks = matrix.tobsr((d, d))
    n = matrix.shape[0] // d
    node = np.repeat(np.arange(n), np.diff(blocks.indptr))
    row = (node[:, None, None] * d + np.arange(d)[None, :, None]) + np.zeros((1, 1, d), int)
    column = (blocks.indices[:, None, None] * d + np.arange(d)[None, None, :]) + np.zeros((1, d, 1), int)
    return sp.csr_array((blocks.data.ravel(), (row.ravel(), column.ravel())), shape=matrix.shape)


@dataclass(frozen=True)
class Judgement:
    """What the truth says about coordinates: error relative to the diameter, share of true nodes without any.

    Nodes all of whose rows are those of the identity are not counted, since the matrix does not know about them.
    Where the reason says that an affine map stays free the error is what the best one leaves. A node made up of rows
    of several true ones counts as an error of one; `split` counts true nodes that came out as two.
    """

    error: float
    missing: float
    split: int


def judged(found, truth: Given) -> Judgement:
    """Compare piece by piece, up to translation and scale and, for rows at random, names of axes."""
    d = truth.points.shape[1]
    known = np.isfinite(found.points).all(axis=1)
    live = known[found.node_of_row]
    pairs = np.unique(np.column_stack([found.node_of_row, truth.node]), axis=0)
    mixed = np.bincount(pairs[:, 0], minlength=len(known)) > 1
    off = abs(truth.matrix).sum(axis=1) - np.abs(truth.matrix.diagonal())
    present = np.unique(truth.node[off > 0])
    placed = np.intersect1d(truth.node[live], present)
    split = int((np.bincount(pairs[known[pairs[:, 0]], 1]) > 1).sum())
    missing = 1 - len(placed) / len(present)
    if (mixed & known).any() or found.points.shape[1] != d:
        return Judgement(1.0, missing, split)
    true = np.zeros((len(known), d))
    true[found.node_of_row] = truth.points[truth.node]
    worst = 0.0
    for piece in range(found.component.max() + 1):
        here = found.component == piece
        named = np.zeros((d, d))
        rows = here[found.node_of_row]
        np.add.at(named, (found.direction_of_row[rows], truth.direction[rows]), 1)
        axes = max(permutations(range(d)), key=lambda one, named=named: named[range(d), one].sum())
        if here.any() and "affine" in found.reason:
            worst = max(worst, _up_to_affine(found.points[here], true[here][:, axes], np.ptp(truth.points, axis=0)))
        elif here.any():
            worst = max(worst, _misfit(found.points[here], true[here][:, axes], np.ptp(truth.points, axis=0)))
    return Judgement(worst, missing, split)


def assert_certified(case: Given, error: float, missing: float, split: int | None = None) -> None:
    """What comes back has to be certified and right, to leave out no larger share of the nodes, and to split no more.

    `error` is that of positions in diameters.
    """
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified, found.reason
    assert truth.error < error
    assert truth.missing <= missing
    assert split is None or truth.split == split


def _misfit(a: np.ndarray, b: np.ndarray, extent: np.ndarray) -> float:
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    square = (a * a).sum()
    scale = (a * b).sum() / square if square > 0 else 0.0
    return float(np.linalg.norm(scale * a - b, axis=1).max() / np.linalg.norm(extent))


def _up_to_affine(a: np.ndarray, b: np.ndarray, extent: np.ndarray) -> float:
    design = np.column_stack([a, np.ones(len(a))])
    left = b - design @ np.linalg.lstsq(design, b, rcond=None)[0]
    return float(np.linalg.norm(left, axis=1).max() / np.linalg.norm(extent))
