"""Entries between nodes, and what cells add to them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...budget import AT_ONCE
from ...elements.cliques import Graph
from ...elements.kinds import Kind
from ...elements.reference import Rule, elasticity
from ...nodes.nodal import NodalMatrix, valid_pairs
from ...tolerances import CERTIFIED, LAST_DIGITS


@dataclass(frozen=True, eq=False)
class BlockEntries:
    """Blocks above the diagonal that complete cells alone explain; see :func:`.cells.recognise_cells`."""

    n: int  # nodes
    key: NDArray[np.int64]  # (e,) pairs i < j as i n + j, increasing
    value: NDArray[np.float64]  # (e, d, d), zero where not told
    told: NDArray[np.bool_]  # (e, d, d) places of unknowns that the matrix has
    size: NDArray[np.float64]  # (e,) largest entry of the two nodes' rows, the smaller of the two
    complete: NDArray[np.bool_]  # (n,) nodes that lost no neighbour, and of which none is unknown
    sure: NDArray[np.bool_]  # (n,) those of which every row shows it
    allowed: float  # what a value may be off by, relative to `size`

    @classmethod
    def of(
        cls,
        nodal: NodalMatrix,
        known: NDArray[np.bool_],
        likely: NDArray[np.bool_] | None = None,
        allowed: float = CERTIFIED,
    ) -> BlockEntries:
        """Those of a matrix between nodes whose places are `known`, (n,); cells that have others are as good as lost.

        Nodes that are `likely`, (n,), count as complete though not every row shows it.
        """
        alone = np.bincount(nodal.node, ~known[nodal.indices], minlength=nodal.n) == 0
        sure = np.asarray(valid_pairs(nodal).all(axis=(1, 2)) & alone)
        complete = sure if likely is None else sure | likely & alone
        i, j = nodal.node.astype(np.int64), nodal.indices.astype(np.int64)
        off = np.where(i == j, 0, np.abs(nodal.data).max(axis=(1, 2)))
        largest = np.maximum.reduceat(off, nodal.indptr[:-1])
        use = (i < j) & (complete[i] | complete[j]) & known[i] & known[j]
        i, j = i[use], j[use]
        present = nodal.row_of >= 0
        told = present[i][:, :, None] & present[j][:, None, :]
        size = np.minimum(largest[i], largest[j])
        size = np.where(size > 0, size, 1.0)
        return cls(nodal.n, i * nodal.n + j, nodal.data[use], told, size, complete, sure, allowed)

    @property
    def nothing(self) -> float:
        """Relative size up to which a value is zero: by the last digits, unless entries are known to fewer."""
        return LAST_DIGITS if self.allowed <= CERTIFIED else self.allowed

    @property
    def largest(self) -> float:
        """Largest of the values relative to their row."""
        return float(np.abs(self.value / self.size[:, None, None]).max(initial=0))

    def at(self, place: NDArray[np.int64]) -> BlockEntries:
        """Some of them."""
        return replace(self, key=self.key[place], value=self.value[place], told=self.told[place], size=self.size[place])

    def shown(self) -> NDArray[np.bool_]:
        """(n, d) unknowns whose rows have one of these entries that is not zero."""
        seen = np.zeros((self.n, self.value.shape[1]), dtype=bool)
        i, j = np.divmod(self.key, self.n)
        entry = np.abs(self.value) > CERTIFIED * self.size[:, None, None]
        np.logical_or.at(seen, i, entry.any(axis=2))
        np.logical_or.at(seen, j, entry.any(axis=1))
        return seen

    def explained_by(self, pairs: Sequence[Pairs], graph: Graph) -> BlockEntries | None:
        """Entries that cells of all kinds explain; None if some belong to no cell, and not since a cell lost a node.

        A node may have lost a neighbour without a trace, where their entry was zero: the middle of a straight side of a
        quadratic triangle, and the corner facing it; or two nodes on rollers. Its entries with others of that cell
        tell, and what both ends of such an entry couple to are the nodes of the cell.
        """
        outside = np.abs(self.value).max(axis=(1, 2)) > self.nothing * self.size
        for own in pairs:
            outside[own.place[own.there]] = False
        i, j = np.divmod(self.key, self.n)
        if (outside & self.sure[i] & self.sure[j]).any():
            return None
        complete = self.complete.copy()
        complete[i[outside]] = complete[j[outside]] = False
        closed = graph.closed
        complete[closed[i[outside]].multiply(closed[j[outside]]).nonzero()[1]] = False
        return replace(self.at(np.flatnonzero(complete[i] | complete[j])), complete=complete)


@dataclass(frozen=True, eq=False)
class Pairs:
    """The pairs of nodes of cells among the entries, (m, k (k - 1) / 2) each."""

    place: NDArray[np.int64]  # of the entry; any where there is none
    there: NDArray[np.bool_]  # whether there is one
    flip: NDArray[np.bool_]  # whether the entry is that of the pair the other way round

    @classmethod
    def of(cls, cells: NDArray[np.int64], entries: BlockEntries) -> Pairs:
        """Those of cells (m, k)."""
        a, b = np.triu_indices(cells.shape[1], 1)
        i, j = cells[:, a], cells[:, b]
        key = np.minimum(i, j) * entries.n + np.maximum(i, j)
        place = np.minimum(np.searchsorted(entries.key, key), len(entries.key) - 1)
        return cls(place, entries.key[place] == key, i > j)

    def at(self, cells: NDArray[np.int64] | slice) -> Pairs:
        """Those of some of the cells."""
        return Pairs(self.place[cells], self.there[cells], self.flip[cells])

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(m,) cells that contribute to one of the entries at least."""
        return np.asarray(self.there.any(axis=1))


def claims(pairs: Sequence[Pairs], entries: BlockEntries) -> NDArray[np.int64]:
    """(e,) how many cells contribute to each entry."""
    place = np.concatenate([one.place[one.there] for one in pairs])
    return np.bincount(place, minlength=len(entries.key))


def added(total: NDArray[np.float64], place: NDArray[np.int64], blocks: NDArray[np.float64]) -> None:
    """Add blocks (p, d, d) at places of the flat blocks `total`, in place."""
    dd = blocks.shape[1] * blocks.shape[2]
    where = place[:, None] * dd + np.arange(dd)
    total += np.bincount(where.ravel(), blocks.ravel(), len(total))


@dataclass(frozen=True, eq=False)
class MaterialModel:
    """How the matrix depends on the material: cells (m, k) of a kind on points (n, d), integrated by a rule."""

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    kind: Kind
    rule: Rule

    def contributions(
        self, pairs: Pairs, entries: BlockEntries, some: NDArray | slice = slice(None)
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

    def most_added(self, pairs: Pairs, entries: BlockEntries, lame: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m,) the most that each cell with coefficients (m, 2) adds to an entry, relative to the size of its rows."""
        most = np.zeros(len(self.cells))
        for batch, unit in self.contributions(pairs, entries):
            part = np.abs(np.einsum("ms,smpcb->mpcb", lame[batch], unit)).max(axis=(2, 3))
            relative = np.where(pairs.there[batch], part / entries.size[pairs.place[batch]], 0.0)
            most[batch] = relative.max(axis=1)
        return most

    def assembled(self, pairs: Pairs, entries: BlockEntries, lame: NDArray[np.float64]) -> NDArray[np.float64]:
        """(e, d, d) entries of cells with coefficients (m, 2)."""
        total = np.zeros(entries.value.size)
        for batch, unit in self.contributions(pairs, entries):
            there = pairs.there[batch]
            part = np.einsum("ms,smpcb->mpcb", lame[batch], unit)
            added(total, pairs.place[batch][there], part[there])
        return total.reshape(entries.value.shape)

    def operator(self, pairs: Pairs, entries: BlockEntries) -> sp.csr_array:
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
