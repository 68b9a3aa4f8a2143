"""Lame coefficients of cells that have entries of their own, cell by cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .entries import Entries, Pairs, added, claims
from .model import Model, largest

_ROUNDS = 6  # cells next to supports may wait for their neighbours
_INDEPENDENT = 1e-10  # least eigenvalue of the scaled normal equations of a cell whose coefficients show


@dataclass(frozen=True, eq=False)
class Peeled:
    """What is left of the entries once cells are taken away.

    Attributes
    ----------
    lame : (m, 2) float64
        Means over each cell.
    rest : (e, d, d) float64
        Entries without what the cells add.
    misfit : float
        Largest of the rest relative to its row, which is that of the fit if no other cells are there; infinite where
        coefficients of some cells stay open.
    """

    lame: NDArray[np.float64]
    rest: NDArray[np.float64]
    misfit: float


def cell_by_cell(model: Model, entries: Entries, beside: Sequence[Pairs] = ()) -> Peeled:
    """Coefficients of each cell from the entries that no other cell contributes to, nor those `beside`.

    Two nodes on opposite sides of a cell share that cell only, so that their entries tell its coefficients. A cell next
    to a support may lack such entries until its neighbours' contributions are taken away. If cells stay open the
    misfit is infinite.
    """
    pairs = Pairs.of(model.cells, entries)
    d = model.kind.dim
    rest = entries.value.reshape(-1).copy()
    coefficients = np.zeros((len(model.cells), model.unknowns))
    todo = np.flatnonzero(pairs.seen)
    count = claims((pairs, *beside), entries)
    for _ in range(_ROUNDS):
        left = [todo[:0]]
        alone = count == 1
        for batch, unit in model.contributions(pairs, entries, todo):
            some = todo[batch]
            place, there = pairs.place[some], pairs.there[some]
            own = there & alone[place]
            found = _least_squares(unit, rest.reshape(-1, d, d)[place], own / entries.size[place])
            solved = np.isfinite(found[:, 0])
            coefficients[some[solved]] = found[solved]
            place, there = place[solved], there[solved]
            sums = np.einsum("sm,smpcb->mpcb", found[solved].T, unit[:, solved])
            added(rest, place[there], -sums[there])
            count -= np.bincount(place[there], minlength=len(count))
            left.append(some[~solved])
        before, todo = len(todo), np.concatenate(left)
        if not 0 < len(todo) < before:
            break
    blocks = rest.reshape(-1, d, d)
    return Peeled(model.mean(coefficients), blocks, np.inf if len(todo) else largest(blocks, entries))


def _least_squares(unit: NDArray, target: NDArray, weight: NDArray) -> NDArray[np.float64]:
    """(m, s) coefficients of each cell for which its weighted pairs fit best; NaN where they tell too little."""
    s, m = unit.shape[:2]
    columns = (unit * weight[..., None, None]).transpose(1, 0, 2, 3, 4).reshape(m, s, -1)
    normal = columns @ columns.transpose(0, 2, 1)
    right = columns @ (target * weight[..., None, None]).reshape(m, -1, 1)
    size = np.sqrt(np.maximum(np.diagonal(normal, axis1=1, axis2=2), 1e-300))
    normal = normal / (size[:, :, None] * size[:, None, :])
    enough = np.linalg.eigvalsh(normal)[:, 0] > _INDEPENDENT
    found = np.full((m, s), np.nan)
    found[enough] = np.linalg.solve(normal[enough], (right[..., 0] / size)[enough][..., None])[..., 0] / size[enough]
    return found
