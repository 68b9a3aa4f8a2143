"""Lame coefficients of cells whose nodes are known: the matrix is linear in them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..linalg import threads
from .elements import point_volumes
from .entries import Entries, Pairs, contributions
from .kinds import Kind
from .reference import Rule

_ROUNDS = 6  # cells next to supports may wait for their neighbours
FITS = 1e-9  # relative misfit of an entry that is rounding
_FEW = 0.3  # of the candidates: how many may be no cells
_INDEPENDENT = 1e-10  # least eigenvalue of the scaled normal equations of a cell whose coefficients show


@dataclass(frozen=True, eq=False)
class Model:
    """How the matrix depends on the material: cells of a kind, integrated by a rule.

    Attributes
    ----------
    points : (n, d) float64
    cells : (m, k) int64
    kind : Kind
    rule : (q, d) and (q,) float64
    varying : bool
        One pair of coefficients for each quadrature point, not one for each cell.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    kind: Kind
    rule: Rule
    varying: bool = False

    @property
    def unknowns(self) -> int:
        """Coefficients of a cell."""
        return 2 * len(self.rule[1]) if self.varying else 2

    @property
    def coefficients(self) -> int:
        """Nonzero numbers of the matrix that takes all coefficients to the entries."""
        return len(self.cells) * self.kind.nodes * (self.kind.nodes - 1) // 2 * self.kind.dim**2 * self.unknowns

    def contributions(
        self, flip: NDArray, some: NDArray | slice = slice(None)
    ) -> Iterator[tuple[slice, NDArray[np.float64]]]:
        """See :func:`.entries.contributions`."""
        return contributions(self.points, self.cells[some], self.kind, self.rule, flip[some], varying=self.varying)

    def mean(self, coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m, 2) lambda and mu of each cell from its coefficients (m, s)."""
        if not self.varying:
            return coefficients
        share = point_volumes(self.points, self.cells, self.kind, self.rule)
        return np.einsum("mq,msq->ms", share, coefficients.reshape(len(self.cells), 2, -1))


@dataclass(frozen=True, eq=False)
class Fit:
    """Lame coefficients and how well they fit.

    Attributes
    ----------
    lame : (m, 2) float64
        Means over each cell; zero for candidates that carry no material.
    misfit : float
        Largest difference between an entry and the re-assembled one, relative to its row.
    """

    lame: NDArray[np.float64]
    misfit: float


def one_material(model: Model, entries: Entries, ratio: float) -> Fit:
    """Coefficients of a body whose cells have (ratio mu, mu), the same mu for all but candidates that are no cells.

    Of these there have to be few. They overfill all entries that they contribute to; among candidates of which that
    is true, least squares tell which are cells.
    """
    pairs = Pairs.of(model.cells, entries)
    blocks = _assembled(model, pairs, entries, ratio, np.ones(len(model.cells)))
    mu = _usual_factor(blocks, entries)
    if mu == 0:
        return Fit(np.zeros((len(model.cells), 2)), np.inf)
    poor = np.abs(mu * blocks - entries.value).max(axis=(1, 2)) > FITS * entries.size
    suspects = np.flatnonzero((poor[pairs.place] | ~pairs.there).all(axis=1))
    share = np.ones(len(model.cells))
    if 0 < len(suspects) < _FEW * len(model.cells):
        few = Model(model.points, model.cells[suspects], model.kind, model.rule)
        own = Pairs(pairs.place[suspects], pairs.there[suspects], pairs.flip[suspects])
        share[suspects] = 0
        rest = entries.value - mu * _assembled(model, pairs, entries, ratio, share)
        units = ((batch, ratio * unit[:1] + unit[1:]) for batch, unit in few.contributions(own.flip))
        operator = _operator(units, own, entries, 1)
        share[suspects] = _least_squares_solution(operator, rest, entries) / mu > 0.5
        blocks = _assembled(model, pairs, entries, ratio, share)
    lame = share[:, None] * np.array([ratio * mu, mu])
    return Fit(lame, _largest(mu * blocks - entries.value, entries))


def _assembled(model: Model, pairs: Pairs, entries: Entries, ratio: float, share: NDArray) -> NDArray[np.float64]:
    """(e, d, d) entries of cells with coefficients (ratio, 1) times their share."""
    d = model.kind.dim
    total = np.zeros(len(entries.key) * d * d)
    for batch, (first, second) in model.contributions(pairs.flip):
        there = pairs.there[batch]
        part = (ratio * first + second) * share[batch, None, None, None]
        _add(total, pairs.place[batch][there], part[there])
    return total.reshape(-1, d, d)


def _usual_factor(blocks: NDArray, entries: Entries) -> float:
    """Between the entries and those assembled, whatever a few candidates too many add."""
    square = (blocks * blocks).sum(axis=(1, 2))
    weighty = square > 1e-12 * square.max(initial=0)
    if not weighty.any():
        return 0.0
    return float(np.median((blocks * entries.value).sum(axis=(1, 2))[weighty] / square[weighty]))


def cell_by_cell(model: Model, entries: Entries) -> Fit:
    """Coefficients of each cell from the entries that no other cell contributes to.

    Two nodes on opposite sides of a cell share that cell only, so that their entries tell its coefficients. A cell next
    to a support may lack such entries until its neighbours' contributions are taken away. If cells stay open the
    misfit is infinite.
    """
    pairs = Pairs.of(model.cells, entries)
    d = model.kind.dim
    rest = entries.value.reshape(-1).copy()
    coefficients = np.zeros((len(model.cells), model.unknowns))
    todo = np.flatnonzero(pairs.seen)
    count = np.bincount(pairs.place[pairs.there], minlength=len(entries.key))
    for _ in range(_ROUNDS):
        left = [todo[:0]]
        alone = count == 1
        for batch, unit in model.contributions(pairs.flip, todo):
            some = todo[batch]
            place, there = pairs.place[some], pairs.there[some]
            own = there & alone[place]
            found = _least_squares(unit, rest.reshape(-1, d, d)[place], own / entries.size[place])
            solved = np.isfinite(found[:, 0])
            coefficients[some[solved]] = found[solved]
            place, there = place[solved], there[solved]
            sums = np.einsum("sm,smpcb->mpcb", found[solved].T, unit[:, solved])
            _add(rest, place[there], -sums[there])
            count -= np.bincount(place[there], minlength=len(count))
            left.append(some[~solved])
        before, todo = len(todo), np.concatenate(left)
        if not 0 < len(todo) < before:
            break
    misfit = np.inf if len(todo) else _largest(rest.reshape(-1, d, d), entries)
    return Fit(model.mean(coefficients), misfit)


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


def all_at_once(model: Model, entries: Entries) -> Fit:
    """Coefficients of all candidates by one sparse least-squares problem.

    For linear cells: neighbours share most of their entries, and candidates that carry no material get zeros.
    """
    pairs = Pairs.of(model.cells, entries)
    operator = _operator(model.contributions(pairs.flip), pairs, entries, model.unknowns)
    coefficients = _least_squares_solution(operator, entries.value, entries)
    misfit = operator @ coefficients - (entries.value / entries.size[:, None, None]).ravel()
    return Fit(model.mean(coefficients.reshape(-1, model.unknowns)), float(np.abs(misfit).max()))


def _operator(
    contributions: Iterator[tuple[slice, NDArray]], pairs: Pairs, entries: Entries, unknowns: int
) -> sp.csr_array:
    """(entries d d, cells unknowns) what coefficients add to the entries, relative to their size."""
    dd = entries.value[0].size
    rows, columns, values = [], [], []
    for batch, unit in contributions:
        there = pairs.there[batch]
        place = pairs.place[batch][there]
        cell = np.arange(len(pairs.there))[batch][np.nonzero(there)[0]]
        for number, part in enumerate(unit):
            rows.append((place[:, None] * dd + np.arange(dd)).ravel())
            columns.append(np.repeat(unknowns * cell + number, dd))
            values.append((part[there] / entries.size[place][:, None, None]).ravel())
    shape = (len(entries.key) * dd, unknowns * len(pairs.there))
    return sp.csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)


def _least_squares_solution(operator: sp.csr_array, value: NDArray, entries: Entries) -> NDArray[np.float64]:
    """Coefficients that fit entries best; zero where none shows."""
    weight = np.sqrt(np.asarray(operator.power(2).sum(axis=0)).ravel())
    seen = weight > 0
    scaled = operator[:, np.flatnonzero(seen)] @ sp.diags_array(1 / weight[seen])
    target = (value / entries.size[:, None, None]).ravel()
    coefficients = np.zeros(operator.shape[1])
    with threads(1):  # its many short vectors are not worth waking threads for
        coefficients[seen] = sp.linalg.lsmr(scaled, target, atol=1e-15, btol=1e-15, conlim=0, maxiter=600)[0]
    coefficients[seen] /= weight[seen]
    return coefficients


def _add(total: NDArray, place: NDArray, blocks: NDArray) -> None:
    """Add blocks (p, d, d) at places of the flat blocks `total`."""
    dd = blocks.shape[1] * blocks.shape[2]
    where = place[:, None] * dd + np.arange(dd)
    total += np.bincount(where.ravel(), blocks.ravel(), len(total))


def _largest(misfit: NDArray, entries: Entries) -> float:
    return float(np.abs(misfit / entries.size[:, None, None]).max())
