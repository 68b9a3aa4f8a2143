"""What cells with given coefficients add to entries between nodes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...budget import AT_ONCE
from ...elements.kinds import Kind
from ...elements.reference import Rule, elasticity
from .entries import Entries, Pairs


def claims(pairs: Sequence[Pairs], entries: Entries) -> NDArray[np.int64]:
    """(e,) how many cells contribute to each entry."""
    place = np.concatenate([one.place[one.there] for one in pairs])
    return np.bincount(place, minlength=len(entries.key))


def added(total: NDArray[np.float64], place: NDArray[np.int64], blocks: NDArray[np.float64]) -> None:
    """Add blocks (p, d, d) at places of the flat blocks `total`, in place."""
    dd = blocks.shape[1] * blocks.shape[2]
    where = place[:, None] * dd + np.arange(dd)
    total += np.bincount(where.ravel(), blocks.ravel(), len(total))


@dataclass(frozen=True, eq=False)
class Model:
    """How the matrix depends on the material: cells (m, k) of a kind on points (n, d), integrated by a rule."""

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    kind: Kind
    rule: Rule

    def contributions(
        self, pairs: Pairs, entries: Entries, some: NDArray | slice = slice(None)
    ) -> Iterator[tuple[slice, NDArray[np.float64]]]:
        """What unit Lame coefficients, (1, 0) and (0, 1), of some cells add to the entries of their pairs, by batches.

        The cells of a batch, and (2, b, pairs, d, d); zero where unknowns lack.
        """
        own, cells = pairs.at(some), self.cells[some]
        k, d, partial = self.kind.nodes, self.kind.dim, not entries.told.all()
        a, b = np.triu_indices(k, 1)
        step = max(AT_ONCE // (k * d * (3 * k * d + 2 * len(self.rule[1]))), 1)
        for start in range(0, len(cells), step):
            batch = slice(start, start + step)
            unit = np.stack([one[:, a, b] for one in elasticity(self.points, cells[batch], self.kind, self.rule)])
            turned = own.flip[batch]
            unit[:, turned] = unit[:, turned].swapaxes(-1, -2)
            yield batch, unit * entries.told[own.place[batch]] if partial else unit

    def assembled(self, pairs: Pairs, entries: Entries, lame: NDArray[np.float64]) -> NDArray[np.float64]:
        """(e, d, d) entries of cells with coefficients (m, 2)."""
        total = np.zeros(entries.value.size)
        for batch, unit in self.contributions(pairs, entries):
            there = pairs.there[batch]
            part = np.einsum("ms,smpcb->mpcb", lame[batch], unit)
            added(total, pairs.place[batch][there], part[there])
        return total.reshape(entries.value.shape)

    def operator(self, pairs: Pairs, entries: Entries) -> sp.csr_array:
        """(e d d, 2 m) what coefficients add to the entries, relative to their size."""
        dd = self.kind.dim**2
        rows, columns, values = [np.empty(0, np.int64)], [np.empty(0, np.int64)], [np.empty(0)]
        for batch, unit in self.contributions(pairs, entries):
            there = pairs.there[batch]
            place = pairs.place[batch][there]
            cell = np.arange(len(self.cells))[batch][np.nonzero(there)[0]]
            for number, part in enumerate(unit):
                rows.append((place[:, None] * dd + np.arange(dd)).ravel())
                columns.append(np.repeat(2 * cell + number, dd))
                values.append((part[there] / entries.size[place][:, None, None]).ravel())
        shape = (entries.value.size, 2 * len(self.cells))
        return sp.csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)
