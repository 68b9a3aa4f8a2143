"""Entries between nodes, and what cells add to them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .elements import element_blocks, point_blocks
from .kinds import Kind
from .nodal import NodalMatrix, valid_pairs
from .reference import Rule

_AT_ONCE = 8_000_000  # numbers in the blocks and gradients of one batch of cells


@dataclass(frozen=True, eq=False)
class Entries:
    """Blocks above the diagonal that complete cells alone explain.

    Entries between two nodes that both miss a neighbour are left out, since cells that lost a node to a support
    contribute to them.

    Attributes
    ----------
    n : int
        Nodes.
    key : (e,) int64
        Pairs i < j as i n + j, increasing.
    value : (e, d, d) float64
    size : (e,) float64
        Largest entry of the two nodes' rows, the smaller of the two.
    complete : (n,) bool
        Nodes that lost no neighbour.
    """

    n: int
    key: NDArray[np.int64]
    value: NDArray[np.float64]
    size: NDArray[np.float64]
    complete: NDArray[np.bool_]

    @classmethod
    def of(cls, nodal: NodalMatrix) -> Entries:
        """Those of a matrix."""
        complete = np.asarray(valid_pairs(nodal).all(axis=(1, 2)))
        i, j = nodal.node.astype(np.int64), nodal.indices.astype(np.int64)
        off = np.abs(nodal.data).max(axis=(1, 2))
        off[i == j] = 0
        largest = np.maximum.reduceat(off, nodal.indptr[:-1])
        use = (i < j) & (complete[i] | complete[j])
        size = np.minimum(largest[i[use]], largest[j[use]])
        return cls(nodal.n, i[use] * nodal.n + j[use], nodal.data[use], np.where(size > 0, size, 1.0), complete)

    def at(self, place: NDArray[np.int64]) -> Entries:
        """Some of them."""
        return Entries(self.n, self.key[place], self.value[place], self.size[place], self.complete)

    def explained_by(self, pairs: Pairs, tolerance: float) -> Entries | None:
        """Entries that cells explain; None if some belong to no cell, and not since a cell lost a node.

        A node may have lost a neighbour without a trace, where their entry was zero: the middle of a straight side of a
        quadratic triangle, and the corner facing it. Its entries with others of that cell tell.
        """
        outside = np.abs(self.value).max(axis=(1, 2)) > tolerance * self.size
        outside[pairs.place[pairs.there]] = False
        i, j = np.divmod(self.key, self.n)
        if (outside & self.complete[i] & self.complete[j]).any():
            return None
        complete = self.complete.copy()
        complete[i[outside]] = complete[j[outside]] = False
        some = self.at(np.flatnonzero(complete[i] | complete[j]))
        return Entries(some.n, some.key, some.value, some.size, complete)


@dataclass(frozen=True, eq=False)
class Pairs:
    """The pairs of nodes of cells among the entries, (m, k (k - 1) / 2) each.

    Attributes
    ----------
    place : int64
        Of the entry; any where there is none.
    there : bool
        Whether there is one.
    flip : bool
        Whether the entry is that of the pair the other way round.
    """

    place: NDArray[np.int64]
    there: NDArray[np.bool_]
    flip: NDArray[np.bool_]

    @classmethod
    def of(cls, cells: NDArray[np.int64], entries: Entries) -> Pairs:
        """Those of cells (m, k)."""
        a, b = np.triu_indices(cells.shape[1], 1)
        i, j = cells[:, a], cells[:, b]
        key = np.minimum(i, j) * entries.n + np.maximum(i, j)
        place = np.minimum(np.searchsorted(entries.key, key), len(entries.key) - 1)
        return cls(place, entries.key[place] == key, i > j)

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(m,) cells that contribute to one of the entries at least."""
        return np.asarray(self.there.any(axis=1))


def contributions(
    points: NDArray[np.float64],
    cells: NDArray[np.int64],
    kind: Kind,
    rule: Rule,
    flip: NDArray[np.bool_],
    *,
    varying: bool = False,
) -> Iterator[tuple[slice, NDArray[np.float64]]]:
    """What unit Lame coefficients of each cell add to the entries of its pairs, batch by batch.

    Yields
    ------
    batch : slice
        Of the cells.
    unit : (s, b, pairs, d, d) float64
        For (lambda, mu) = (1, 0) and (0, 1); if `varying`, at one quadrature point after the other, first for lambda.
    """
    k, d, q = kind.nodes, kind.dim, len(rule[1])
    a, b = np.triu_indices(k, 1)
    step = max(_AT_ONCE // (k * d * (2 * q * k * d if varying else 3 * k * d + 2 * q)), 1)
    for start in range(0, len(cells), step):
        batch = slice(start, start + step)
        blocks = (point_blocks if varying else element_blocks)(points, cells[batch], kind, rule)
        unit = np.stack([block[:, a, b] for block in blocks])
        turned = flip[batch]
        unit[:, turned] = unit[:, turned].swapaxes(-1, -2)
        yield batch, unit
