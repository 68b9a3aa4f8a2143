"""Entries between nodes, and what cells add to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...elements.cliques import Graph
from ...nodes.nodal import NodalMatrix, valid_pairs
from ...tolerances import CERTIFIED


@dataclass(frozen=True, eq=False)
class Entries:
    """Blocks above the diagonal that complete cells alone explain; see :func:`.cells.recognise_cells`."""

    n: int  # nodes
    key: NDArray[np.int64]  # (e,) pairs i < j as i n + j, increasing
    value: NDArray[np.float64]  # (e, d, d), zero where not told
    told: NDArray[np.bool_]  # (e, d, d) places of unknowns that the matrix has
    size: NDArray[np.float64]  # (e,) largest entry of the two nodes' rows, the smaller of the two
    complete: NDArray[np.bool_]  # (n,) nodes that lost no neighbour, and of which none is unknown
    sure: NDArray[np.bool_]  # (n,) those of which every row shows it

    @classmethod
    def of(cls, nodal: NodalMatrix, known: NDArray[np.bool_], likely: NDArray[np.bool_] | None = None) -> Entries:
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
        return cls(nodal.n, i * nodal.n + j, nodal.data[use], told, np.where(size > 0, size, 1.0), complete, sure)

    @property
    def largest(self) -> float:
        """Largest of the values relative to their row."""
        return float(np.abs(self.value / self.size[:, None, None]).max(initial=0))

    def at(self, place: NDArray[np.int64]) -> Entries:
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

    def explained_by(self, pairs: Sequence[Pairs], graph: Graph) -> Entries | None:
        """Entries that cells of all kinds explain; None if some belong to no cell, and not since a cell lost a node.

        A node may have lost a neighbour without a trace, where their entry was zero: the middle of a straight side of a
        quadratic triangle, and the corner facing it; or two nodes on rollers. Its entries with others of that cell
        tell, and what both ends of such an entry couple to are the nodes of the cell.
        """
        outside = np.abs(self.value).max(axis=(1, 2)) > CERTIFIED * self.size
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
    def of(cls, cells: NDArray[np.int64], entries: Entries) -> Pairs:
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
