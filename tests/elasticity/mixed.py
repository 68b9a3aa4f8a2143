"""Meshes of two kinds of cells that share nodes, assembled kind by kind with scikit-fem and added up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from assembled import ELEMENTS, Assembled, box, stiffness
from scipy.spatial import cKDTree

KIND = {"tri-p1": "triangle", "quad-q1": "quad"}


@dataclass(frozen=True)
class Mixed:
    """A matrix, node by node, its points, and the cells of each kind as sets of nodes."""

    matrix: sp.csr_array
    points: np.ndarray
    cells: dict[str, set[frozenset[int]]]


def mixed(counts, *, perturb=0.0, seed=0, layered=False, vary=False, lam=1.5) -> Mixed:
    """A box of which about half the quadrilaterals are cut into triangles; nodes in random order."""
    rng = np.random.default_rng(seed)
    base = box("quad-q1", counts, perturb=perturb, seed=seed)
    centre = base.p[0, base.t].mean(axis=0)
    cut = centre > 0.5 if layered else rng.random(base.nelements) < 0.5
    boxes, pieces = base.t[:, ~cut], base.t[:, cut]
    flip = rng.random(pieces.shape[1]) < 0.5
    halves = [pieces[rows][:, flip == turned] for turned, rows in _HALVES]
    parts = {"tri-p1": np.hstack(halves), "quad-q1": boxes}
    d, n = base.p.shape
    total = sp.csr_array((n * d, n * d))
    for kind, cells in parts.items():
        total = total + _part(kind, base.p, cells, rng if vary else None, lam)
    order = rng.permutation(n)
    place = np.argsort(order)
    rows = (order[:, None] * d + np.arange(d)).ravel()
    sets = {KIND[kind]: {frozenset(cell) for cell in place[cells.T].tolist()} for kind, cells in parts.items()}
    return Mixed(sp.csr_array(total[rows][:, rows]), base.p.T[order], sets)


_HALVES = [(False, [0, 1, 2]), (False, [0, 2, 3]), (True, [0, 1, 3]), (True, [1, 2, 3])]


def _part(kind: str, points: np.ndarray, cells: np.ndarray, rng, lam) -> sp.csr_array:
    """What the cells of one kind add to the matrix."""
    d, n = points.shape
    used, local = np.unique(cells, return_inverse=True)
    mesh = ELEMENTS[kind][0](points[:, used].copy(), local.reshape(cells.shape).copy())
    material = {"lam": lam}
    if rng is not None:
        first, second = rng.uniform(1, 3, (2, mesh.nelements, 1))
        material = {"lam": lambda x: first + 0 * x[0], "mu": lambda x: second + 0 * x[0]}
    case: Assembled = stiffness(kind, mesh, **material)
    node = used[cKDTree(mesh.p.T).query(case.points)[1]]
    rows = (node[:, None] * d + np.arange(d)).ravel()
    spread = sp.csr_array((np.ones(len(rows)), (rows, np.arange(len(rows)))), shape=(n * d, len(rows)))
    return spread @ case.matrix @ spread.T
