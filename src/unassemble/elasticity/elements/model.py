"""How a matrix depends on the material of its cells."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .entries import Entries, Pairs, added, contributions
from .kinds import Kind
from .reference import Rule
from .stiffness import point_volumes

FITS = 1e-9  # relative misfit of an entry that is rounding


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
        self, pairs: Pairs, entries: Entries, some: NDArray | slice = slice(None)
    ) -> Iterator[tuple[slice, NDArray[np.float64]]]:
        """See :func:`.entries.contributions`; zero where the matrix lacks an unknown."""
        own = pairs.at(some)
        partial = not entries.told.all()
        for batch, unit in contributions(
            self.points, self.cells[some], self.kind, self.rule, own.flip, varying=self.varying
        ):
            yield batch, unit * entries.told[own.place[batch]] if partial else unit

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


def largest(misfit: NDArray[np.float64], entries: Entries) -> float:
    """Largest of the blocks (e, d, d), relative to their row."""
    return float(np.abs(misfit / entries.size[:, None, None]).max())


def assembled(
    models: Sequence[Model], pairs: Sequence[Pairs], entries: Entries, ratio: float, shares: Sequence[NDArray]
) -> NDArray[np.float64]:
    """(e, d, d) entries of cells with coefficients (ratio, 1) times their share."""
    d = models[0].kind.dim
    total = np.zeros(len(entries.key) * d * d)
    for model, own, share in zip(models, pairs, shares, strict=True):
        for batch, (first, second) in model.contributions(own, entries):
            there = own.there[batch]
            part = (ratio * first + second) * share[batch, None, None, None]
            added(total, own.place[batch][there], part[there])
    return total.reshape(-1, d, d)


def operator(
    contributions: Iterator[tuple[slice, NDArray]], pairs: Pairs, entries: Entries, unknowns: int
) -> sp.csr_array:
    """(entries d d, cells unknowns) what coefficients add to the entries, relative to their size."""
    dd = entries.value[0].size
    shape = (len(entries.key) * dd, unknowns * len(pairs.there))
    if not len(pairs.there):
        return sp.csr_array(shape)
    rows, columns, values = [], [], []
    for batch, unit in contributions:
        there = pairs.there[batch]
        place = pairs.place[batch][there]
        cell = np.arange(len(pairs.there))[batch][np.nonzero(there)[0]]
        for number, part in enumerate(unit):
            rows.append((place[:, None] * dd + np.arange(dd)).ravel())
            columns.append(np.repeat(unknowns * cell + number, dd))
            values.append((part[there] / entries.size[place][:, None, None]).ravel())
    return sp.csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)
