"""Whether elements tell positions apart that the identities do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..elements.entries import Entries, Pairs
from ..elements.model import Model, assembled
from ..nodal import NodalMatrix

_STEP = 1e-4  # of the mean length of an edge: displacement whose effect on entries is measured
_RIGID = 1e-4  # least effect on an entry of a displacement by one such length, relative to the largest
_SAME = 1e-8  # of a row: entries that do not differ by more are the same
_NODES = 40  # whose rows are looked at, and so many again for each function


def rigid(models: tuple[Model, ...], entries: Entries, ratio: float, functions: NDArray[np.float64]) -> bool:
    """Whether no small displacement and change of material leaves the entries as they are, but a change of size.

    Displacements are combinations of functions in all directions. Rows of nodes that these move most are looked at;
    what they tell apart, all do.

    Parameters
    ----------
    models : tuple of Model
        Elements of one material, at the points of the body.
    entries : Entries
        Those that they explain.
    ratio : float
        lambda / mu.
    functions : (n, m) float64
        All combinations of which are displacements, translations aside.
    """
    some = entries.at(_moved(entries, functions))
    models = tuple(
        replace(model, cells=model.cells[seen]) for model in models if (seen := Pairs.of(model.cells, some).seen).any()
    )
    if not models:
        return False
    points, edge = models[0].points, _mean_edge(models)
    effects = [_entries(models, some, points, ratio), _entries(models, some, points, ratio + 1)]
    effects[1] -= effects[0]
    for function in functions.T:
        for axis in range(points.shape[1]):
            step = np.zeros_like(points)
            step[:, axis] = function * (_STEP * edge / np.abs(function).max())
            there, back = (_entries(models, some, points + sign * step, ratio) for sign in (1, -1))
            effects.append((there - back) / (2 * _STEP))
    size = np.linalg.svd(np.linalg.qr(np.column_stack(effects), mode="r"), compute_uv=False)
    return len(size) == len(effects) and bool(size[-2] > _RIGID * size[0])


def interchangeable(nodal: NodalMatrix, valid: NDArray[np.bool_], body: NDArray[np.bool_]) -> bool:
    """Whether two nodes of a body, (n,), have the same entries in all whole rows, so that they may be exchanged.

    As in the middle of a box so small that only one row is whole. Nodes that no such row touches are placed otherwise.
    """
    rows = valid.all(axis=(1, 2))
    rng = np.random.default_rng(0)
    weight = rng.standard_normal(nodal.n) * rows / np.where(rows, nodal.size, 1.0)
    blocks = nodal.data.reshape(-1, nodal.dim**2) @ rng.standard_normal((nodal.dim**2, 2))
    code = np.column_stack([np.bincount(nodal.indices, weight[nodal.node] * one, nodal.n)[body] for one in blocks.T])
    code = code[(code != 0).any(axis=1)]
    code = code[np.argsort(code[:, 0])]  # of many nodes two have one number in common by chance, but not two
    return bool((np.abs(np.diff(code, axis=0)) < _SAME).all(axis=1).any())


def _moved(entries: Entries, functions: NDArray) -> NDArray[np.int64]:
    """Entries of the nodes that functions move most, of those all of whose entries are there."""
    motion = np.where(entries.complete, (functions**2).sum(axis=1), -1.0)
    nodes = np.argsort(-motion, kind="stable")[: _NODES * (1 + functions.shape[1])]
    chosen = np.zeros(entries.n, dtype=bool)
    chosen[nodes[motion[nodes] >= 0]] = True
    i, j = np.divmod(entries.key, entries.n)
    return np.flatnonzero(chosen[i] | chosen[j])


def _entries(models: tuple[Model, ...], entries: Entries, points: NDArray, ratio: float) -> NDArray[np.float64]:
    """Entries re-assembled with mu = 1 at points, one after the other."""
    moved = [replace(model, points=points) for model in models]
    pairs = [Pairs.of(model.cells, entries) for model in moved]
    return assembled(moved, pairs, entries, ratio, [np.ones(len(model.cells)) for model in moved]).ravel()


def _mean_edge(models: tuple[Model, ...]) -> float:
    cells, points = models[0].cells, models[0].points
    return float(np.linalg.norm(points[cells[:, 1]] - points[cells[:, 0]], axis=1).mean())
