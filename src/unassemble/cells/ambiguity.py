"""Meshes that the matrix cannot tell apart: rows that can change places.

Two rows with the same neighbours and the same entries are alike to the matrix. If their exchange changes the
cells, which takes vanished entries, it makes another mesh that fits.

A row h with vanished boundary edges around it may have several neighbours that are joined to nothing else, *leaves*.
Consecutive neighbours span right triangles at h, so that with lengths l of the edges from h the entries are

    2 w_x l_x = c (l_before + l_after),

and nothing but these equations says in which order the leaves stand. Another order of the same leaves is another mesh
if its lengths, which follow from the leaves' own equations, are positive and leave the other neighbours' entries as
they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..topology import Polygons

_AGREE = 1e-9
_MOST_LEAVES = 4  # right angles that there is room for around a vertex


@dataclass(frozen=True)
class Exchange:
    """Rows that can change places.

    Attributes
    ----------
    around : tuple of int
        The rows that they are joined to.
    found, other : tuple of int
        In the order of the mesh that was found, and in that of another which fits as well.
    """

    around: tuple[int, ...]
    found: tuple[int, ...]
    other: tuple[int, ...]


def exchanges(
    stored: OperatorMatrix,
    triangles: NDArray,
    polygons: Polygons,
    z: NDArray,
    scale: NDArray,
    *,
    scale_known: bool,
) -> list[Exchange]:
    """Other orders of rows that fit as well as the one found: all twins, and one for each hub of leaves.

    Parameters
    ----------
    stored : OperatorMatrix
        Without the vanished entries.
    triangles : (m, 3) int64
        Not those of divided polygons.
    polygons : Polygons
    z : (n,) complex128
        Positions in the frame in which the operator is the Laplacian.
    scale : (n,) float64
        c at each row.
    scale_known : bool
        Otherwise a star, all of whose rows but one are leaves, may have any c.
    """
    degree = np.bincount(stored.edges.ravel(), minlength=stored.n)
    hubs = stored.edges[(degree[stored.edges] == 1).any(axis=1)]
    hub = np.where(degree[hubs[:, 0]] == 1, hubs[:, 1], hubs[:, 0])
    candidates, leaves = np.unique(hub, return_counts=True)
    candidates = candidates[(leaves >= 2) & (leaves <= _MOST_LEAVES)]
    edges_at, triangles_at = _incidence(stored.edges, stored.n), _incidence(triangles, stored.n)
    found = _twins(stored, degree, triangles, polygons)
    known = {row for twins in found for row in twins.found}
    for h in candidates.tolist():
        star = _Star.of(h, stored, edges_at(h), triangles[triangles_at(h)], z, float(scale[h]))
        exchange = star.exchange(degree, scale_known=scale_known)
        if exchange is not None and not known >= set(exchange.found):
            found.append(exchange)
    return found


def _twins(stored: OperatorMatrix, degree: NDArray, triangles: NDArray, polygons: Polygons) -> list[Exchange]:
    """Pairs of rows with the same two neighbours, or the same one, and the same entries."""
    ends = np.concatenate([stored.edges, stored.edges[:, ::-1]])
    entries = np.tile(stored.entries, 2)
    few = degree[ends[:, 0]] <= 2
    order = np.flatnonzero(few)[np.lexsort((ends[few, 1], ends[few, 0]))]
    row, neighbour, entry = ends[order, 0], ends[order, 1], entries[order]
    start = np.flatnonzero(np.diff(row, prepend=-1))
    last = np.append(start[1:], len(row)) - 1
    alike = np.lexsort((entry[last], entry[start], neighbour[last], neighbour[start]))
    start, last = start[alike], last[alike]
    same = (neighbour[start[1:]] == neighbour[start[:-1]]) & (neighbour[last[1:]] == neighbour[last[:-1]])
    for place in (start, last):
        same &= np.abs(entry[place[1:]] - entry[place[:-1]]) <= _AGREE * np.abs(entry[place[1:]])
    found = []
    for k in np.flatnonzero(same):
        x, y = int(row[start[k]]), int(row[start[k + 1]])
        if _exchange_changes_cells(x, y, triangles, polygons):
            around = tuple(sorted({int(neighbour[start[k]]), int(neighbour[last[k]])}))
            found.append(Exchange(around, (x, y), (y, x)))
    return found


def _exchange_changes_cells(x: int, y: int, triangles: NDArray, polygons: Polygons) -> bool:
    """Whether the cells are others after two vertices have changed names."""
    owner = np.repeat(np.arange(polygons.count), polygons.size)
    longer = np.unique(owner[np.isin(polygons.vertices, (x, y))])
    cells = triangles[np.isin(triangles, (x, y)).any(axis=1)].tolist()
    cells += [polygons.vertices[polygons.offsets[k] : polygons.offsets[k + 1]].tolist() for k in longer]
    swap = {x: y, y: x}
    return {frozenset(cell) for cell in cells} != {frozenset(swap.get(v, v) for v in cell) for cell in cells}


def _incidence(groups: NDArray, n: int) -> Callable[[int], NDArray]:
    """A function from a vertex to the rows of `groups` in which it occurs."""
    order = np.argsort(groups.ravel(), kind="stable")
    start = np.searchsorted(groups.ravel()[order], np.arange(n + 1))
    return lambda vertex: order[start[vertex] : start[vertex + 1]] // groups.shape[1]


@dataclass(frozen=True, eq=False)
class _Star:
    """A hub and its neighbours, in order of their directions."""

    hub: int
    neighbours: NDArray[np.int64]
    lengths: NDArray[np.float64]
    weights: NDArray[np.float64]
    adjacent: NDArray[np.float64]

    @classmethod
    def of(cls, hub: int, stored: OperatorMatrix, rows: NDArray, triangles: NDArray, z: NDArray, c: float) -> _Star:
        neighbours = stored.edges[rows].sum(axis=1) - hub
        legs = z[neighbours] - z[hub]
        turn = np.argsort(np.angle(legs))
        neighbours = neighbours[turn]
        place = {int(row): i for i, row in enumerate(neighbours)}
        adjacent = np.zeros((len(rows), len(rows)))
        for triangle in triangles.tolist():
            i, j = (place.get(row, -1) for row in triangle if row != hub)
            if i >= 0 and j >= 0:
                adjacent[i, j] = adjacent[j, i] = 1.0
        return cls(hub, neighbours, np.abs(legs[turn]), -stored.entries[rows[turn]] / c, adjacent)

    def exchange(self, degree: NDArray, *, scale_known: bool) -> Exchange | None:
        """Another order of the leaves that fits."""
        leaf = np.flatnonzero(degree[self.neighbours] == 1)
        for order in permutations(leaf.tolist()):
            if order == tuple(leaf) or self._same_cells(order, leaf):
                continue
            weights = self.weights.copy()
            weights[leaf] = self.weights[list(order)]
            if _fits(weights, self.lengths, self.adjacent, leaf, scale_known):
                name = self.neighbours.tolist()
                return Exchange((self.hub,), tuple(name[i] for i in leaf), tuple(name[i] for i in order))
        return None

    def _same_cells(self, order: tuple[int, ...], leaf: NDArray) -> bool:
        """Whether leaves in another order have the same neighbours: turned or mirrored as a whole."""
        name = np.arange(len(self.neighbours))
        name[leaf] = order
        renamed = np.zeros_like(self.adjacent)
        renamed[np.ix_(name, name)] = self.adjacent
        return bool((renamed == self.adjacent).all())


def _fits(w: NDArray, lengths: NDArray, adjacent: NDArray, leaf: NDArray, scale_known: bool) -> bool:
    """Whether leaves with weights w (in units of c) have positive lengths, and the others' entries stay."""
    inner = adjacent[np.ix_(leaf, leaf)]
    rest = np.setdiff1d(np.arange(len(w)), leaf)
    if not len(rest):  # a star: the lengths are the Perron vector, its value the factor c
        values, vectors = np.linalg.eig(inner / (2 * w[:, None]))
        best = int(np.argmax(values.real))
        vector = np.real(vectors[:, best] * np.sign(vectors[0, best].real))
        return bool((vector > 0).all()) and (not scale_known or abs(values[best].real - 1) <= _AGREE)
    given = adjacent[np.ix_(leaf, rest)] @ lengths[rest]
    try:
        new = np.linalg.solve(np.diag(2 * w[leaf]) - inner, given)
    except np.linalg.LinAlgError:
        return False
    change = adjacent[np.ix_(rest, leaf)] @ (new - lengths[leaf])
    return bool((new > 0).all()) and bool(np.abs(change).max(initial=0.0) <= _AGREE * lengths.max())
