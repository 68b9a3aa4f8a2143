"""Triangles of a surface in space, closed or not, from its graph: 3-cycles, at most two on each edge."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, milp

from ..budget import SAMPLE
from ..errors import TopologyError
from ..words import count_of
from .cycles import lookup, pairs_in_runs, three_cycles
from .numbering import connected

# The program has a few 3-cycles for each neck, and solids of tetrahedra most of theirs.
_SHARE = 0.5
_LEAST = 5  # triangles at the edges of a neck: two each, but for one edge that may be on the boundary


@dataclass(frozen=True, eq=False)
class Cycles:
    """The 3-cycles of a graph."""

    n: int  # vertices
    edges: NDArray[np.int64]  # (e, 2) pairs i < j in lexicographic order
    triangles: NDArray[np.int64]  # (m, 3)
    opposite: NDArray[np.int64]  # (m, 3) rows of `edges` that face the corners

    @classmethod
    def of(cls, n: int, edges: NDArray) -> Cycles:
        """List them."""
        return cls(n, edges, *three_cycles(n, edges))

    def among(self, triangles: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(m,) those that are some given triangles.

        Raises TopologyError if a triangle is no 3-cycle, or an edge is left over.
        """
        power = np.array([self.n**2, self.n, 1])
        chosen = np.isin(np.sort(self.triangles, axis=1) @ power, np.sort(triangles, axis=1) @ power)
        if chosen.sum() != len(triangles) or not self.at_edges(chosen).all():
            raise TopologyError("the triangles given are not those of the graph")
        return chosen

    def at_edges(self, some: NDArray | slice = slice(None)) -> NDArray[np.int64]:
        """(e,) how many of some of them lie on each edge."""
        return np.bincount(self.opposite[some].ravel(), minlength=len(self.edges))


def surface_readings(cycles: Cycles) -> Iterator[NDArray[np.bool_]]:
    """Which 3-cycles are triangles: selections (m,) bool with one or two on each edge, as many as possible.

    Any triangle of a surface may be left out, and the graph is that of the rest as well. So the convention is that
    holes have more than three edges: of all selections those with the most triangles, which on closed surfaces have
    two on every edge. On most meshes every 3-cycle is one; necks of three edges, 3-cycles that bound no triangle, leave
    a small integer program, solved again with each answer excluded. A neck has triangles on both
    sides of all its edges but one at most: that tells it from a triangle with too many neighbours. All selections of
    that size come, one by one.

    Raises TopologyError if there is none: an edge lies on no 3-cycle, or in three triangles whatever one does. A graph
    with edges on three 3-cycles, all of whose edges belong to tetrahedra, is taken for that of a solid.
    """
    chosen, doubtful = _forced(cycles)
    rows = np.flatnonzero(doubtful)
    if not len(rows):
        yield _checked(cycles, chosen)
        return
    crowded = cycles.at_edges() > 2
    component = connected(cycles.n, *cycles.edges.T)[1][cycles.edges[:, 0]]
    solid = (np.bincount(component, ~in_four_cliques(cycles), minlength=cycles.n)[component] == 0) & crowded
    if solid.any():
        raise _crowded(cycles, int(np.argmax(solid * cycles.at_edges())))
    at, local = np.unique(cycles.opposite[rows], return_inverse=True)
    incidence = sp.csr_array(
        (np.ones(3 * len(rows)), (local.ravel(), np.repeat(np.arange(len(rows)), 3))), shape=(len(at), len(rows))
    )
    taken = cycles.at_edges(chosen)[at]
    each = sp.eye_array(len(rows))
    limits = [
        LinearConstraint(incidence, np.maximum(1 - taken, 0), 2 - taken),
        LinearConstraint(incidence.T @ incidence + _LEAST * each, _LEAST - incidence.T @ taken, np.inf),
    ]
    largest, nodes = None, 1000  # nodes, not seconds, bound the search for all of them
    while nodes > 0:
        found = milp(
            -np.ones(len(rows)),
            integrality=np.ones(len(rows)),
            bounds=Bounds(0, 1),
            constraints=limits,
            options={"node_limit": nodes},
        )
        nodes -= max(found.mip_node_count or 0, 2 * len(rows))  # the first of each takes as long as many more
        size = None if found.x is None else round(-found.fun)
        if size is None and largest is None:
            worst = at[int(np.argmax(np.asarray(incidence.sum(axis=1)).ravel() + taken))]
            raise _crowded(cycles, int(worst))
        if size is None or (largest is not None and size < largest):
            return
        largest = size
        pick = np.round(found.x) > 0
        reading = chosen.copy()
        reading[rows[pick]] = True
        yield _checked(cycles, reading)
        limits.append(LinearConstraint(pick[None, :].astype(float), -np.inf, size - 1))


def _checked(cycles: Cycles, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A selection all of whose omissions are necks."""
    sides = cycles.at_edges(chosen)[cycles.opposite]
    wrong = ~chosen & (sides.sum(axis=1) < _LEAST)
    if wrong.any():
        first = int(np.argmax(wrong))
        raise _crowded(cycles, int(cycles.opposite[first, np.argmax(sides[first])]))
    return chosen


def _forced(cycles: Cycles) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """3-cycles that are triangles in any selection, or that nothing speaks against; and those still open."""
    opposite = cycles.opposite
    open_ = np.ones(len(opposite), dtype=bool)
    chosen = np.zeros(len(opposite), dtype=bool)
    bare = np.flatnonzero(cycles.at_edges() == 0)
    if len(bare):
        i, j = cycles.edges[bare[0]]
        raise TopologyError(f"the edge between rows {i} and {j} lies on no cycle of three edges: this is no surface")
    while True:
        left, taken = cycles.at_edges(open_ | chosen), cycles.at_edges(chosen)
        if (taken > 2).any():
            raise _crowded(cycles, int(np.argmax(taken)))
        needed = ((left == 1) & (taken == 0))[opposite].any(axis=1)
        free = (left <= 2)[opposite].all(axis=1)
        full = (taken == 2)[opposite].any(axis=1)
        new, gone = open_ & (needed | free), open_ & full & ~needed
        if not (new.any() or gone.any()):
            break
        chosen |= new
        open_ &= ~(new | gone)
    if open_.sum() > SAMPLE // 20 + _SHARE * len(open_):
        raise _crowded(cycles, int(np.argmax(cycles.at_edges(open_))))
    return chosen, open_


def _crowded(cycles: Cycles, edge: int) -> TopologyError:
    i, j = cycles.edges[edge]
    count = count_of(int(cycles.at_edges()[edge]), "triangle")
    return TopologyError(f"the edge between rows {i} and {j} lies in {count}: on a surface it is one or two")


def in_four_cliques(cycles: Cycles) -> NDArray[np.bool_]:
    """(e,) edges of complete graphs on four vertices, as all those of tetrahedra are, and of cells of four nodes."""
    adjacent = lookup(cycles.n, cycles.edges)
    order = np.argsort(cycles.opposite.ravel(), kind="stable")
    edge, apex = cycles.opposite.ravel()[order], cycles.triangles.ravel()[order]
    found = np.zeros(len(cycles.edges), dtype=bool)
    for first, second in pairs_in_runs(edge):
        found[edge[first[adjacent(apex[first], apex[second]) >= 0]]] = True
    return found
