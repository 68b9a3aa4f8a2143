"""Pairs of edges along empty faces that may be two sides of a triangle whose third side has vanished."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ...topology.faces import FaceComplex, joined
from .turning import Turns

_MOST_PASSES = 4
"""Of empty faces at a vertex where everything may be next to everything: pairs are as many as squares of passes."""


@dataclass(frozen=True, eq=False)
class OpenCorners:
    """Triangles a-b-c of which a-c is no edge of the graph.

    Attributes
    ----------
    vertices : (k, 3) int64
        a, b, c.
    ends : (k, 2) int64
        Half-edges between a and b, and between b and c.
    sides : (s, 2) int64
        Pairs (corner, half-edge) of what each takes up.
    in_strip : (k,) bool
        See :func:`_in_strips`.
    turned : (k,) bool
        Not as drawn: with a part of the drawing turned over.
    turns : Turns
    """

    vertices: NDArray[np.int64]
    ends: NDArray[np.int64]
    sides: NDArray[np.int64]
    in_strip: NDArray[np.bool_]
    turned: NDArray[np.bool_]
    turns: Turns

    @classmethod
    def of(
        cls, whole: FaceComplex, outside: NDArray[np.bool_], between: NDArray[np.bool_] | None = None
    ) -> OpenCorners:
        """Find them all in a drawing.

        Parameters
        ----------
        whole : FaceComplex
            With blocks hung into each other's empty faces.
        outside : (2 e,) bool
            Half-edges of empty faces.
        between : (2 e,) bool, optional
            Half-edges of those empty faces that may be between any two parts that meet in a vertex.
        """
        half = np.flatnonzero(outside)
        drawn = _Wedges.of(whole, half, whole.successor[half])
        half = half[drawn.open]
        number = np.full(len(outside), -1)
        number[half] = np.arange(len(half))
        arriving, pivot = _passed_twice(whole, outside)
        pivots, arriving = arriving[pivot], arriving[~pivot]
        leaving = whole.successor[arriving]
        crossed = [_Wedges.of(whole, *pair.T) for pair in (arriving, leaving)]
        possible = np.column_stack([wedges.open for wedges in crossed])
        others = np.empty((0, 2), np.int64) if between is None else _between_fans(whole, between)
        apart = _Wedges.of(whole, *others.T)
        wedges = _Wedges.concatenated([drawn, *crossed, apart]).chosen()
        rank = np.empty(len(whole.order), dtype=np.int64)
        rank[whole.order] = np.arange(len(rank))
        turned = np.arange(len(wedges.apex)) >= len(half)
        columns = np.cumsum(possible, axis=0) + len(half) - 1
        columns[:, 1] += possible[:, 0].sum()
        return cls(
            vertices=np.column_stack([wedges.far[:, 0], wedges.apex, wedges.far[:, 1]]),
            ends=wedges.ends,
            sides=_sides(whole, wedges, outside, turned),
            in_strip=np.r_[_in_strips(whole, half), np.zeros(int(turned.sum()), dtype=bool)],
            turned=turned,
            turns=Turns(
                drawn=number[arriving],
                crossed=np.where(possible, columns, -1),
                faces=whole.face[arriving],
                rank=rank[arriving[:, 0]],
                far=np.stack([whole.tail[arriving], whole.head[leaving]], axis=-1),
                pivoted=_same_rows(whole.face[arriving], whole.face[pivots]),
            ),
        )

    def __len__(self) -> int:
        return len(self.vertices)


@dataclass(frozen=True, eq=False)
class _Wedges:
    """Pairs of half-edges (k, 2) at a common vertex, their far ends (k, 2), and whether these are not joined."""

    ends: NDArray[np.int64]
    apex: NDArray[np.int64]
    far: NDArray[np.int64]
    open: NDArray[np.bool_]

    @classmethod
    def of(cls, whole: FaceComplex, one: NDArray, other: NDArray) -> _Wedges:
        """The common vertex is the head of the first half-edge, or the tail of both."""
        both_leave = whole.tail[one] == whole.tail[other]
        apex = np.where(both_leave, whole.tail[one], whole.head[one])
        far = np.column_stack([np.where(whole.head[h] == apex, whole.tail[h], whole.head[h]) for h in (one, other)])
        apart = far[:, 0] != far[:, 1]
        return cls(np.column_stack([one, other]), apex, far, apart & ~joined(whole.n_vertices, whole.edges, *far.T))

    @classmethod
    def concatenated(cls, parts: list[_Wedges]) -> _Wedges:
        """One after the other."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in cls.__dataclass_fields__))

    def chosen(self) -> _Wedges:
        """Those that are open."""
        return _Wedges(*(getattr(self, name)[self.open] for name in self.__dataclass_fields__))


def _passed_twice(whole: FaceComplex, outside: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(k, 2) half-edges that arrive at vertices which empty faces pass twice, by the numbers of the faces.

    And whether there are fewer than four different neighbours there, so that nothing changes where a part is turned
    over.
    """
    half = np.flatnonzero(outside)
    half = half[np.lexsort((whole.face[half], whole.head[half]))]
    at = whole.head[half]
    first = np.flatnonzero(np.diff(at, prepend=-1))
    twice = first[np.diff(np.append(first, len(at))) == 2]
    arriving = np.column_stack([half[twice], half[twice + 1]])
    far = np.column_stack([whole.tail[arriving], whole.head[whole.successor[arriving]]])
    return arriving, np.asarray((np.diff(np.sort(far, axis=1), axis=1) == 0).any(axis=1))


def _between_fans(whole: FaceComplex, outside: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(k, 2) half-edges at vertices that empty faces pass more than twice, but not too often, which are not as drawn.

    What lies between two passes is a fan; nothing tells in which order fans lie about a vertex, nor which of them are
    turned over, so that either end of one may be next to either end of another.
    """
    leaving = whole.successor[np.flatnonzero(outside)]
    passes = np.bincount(whole.tail[leaving], minlength=whole.n_vertices)[whole.tail[leaving]]
    leaving = leaving[(passes > 2) & (passes <= _MOST_PASSES)]
    leaving = leaving[np.argsort(whole.tail[leaving], kind="stable")]
    last = leaving ^ 1  # that arrives at the end of the fan
    while (inside := ~outside[last]).any():
        last[inside] = whole.successor[last[inside]] ^ 1
    fans, pairs = np.column_stack([leaving, last]), []
    for step in range(1, _MOST_PASSES):
        i = np.flatnonzero(whole.tail[leaving[step:]] == whole.tail[leaving[:-step]])
        pairs += [np.column_stack([fans[i, a], fans[i + step, b]]) for a in (0, 1) for b in (0, 1)]
    found = np.concatenate([np.empty((0, 2), np.int64), *pairs])
    drawn = (whole.successor[found[:, 0]] == found[:, 1]) | (whole.successor[found[:, 1]] == found[:, 0])
    return found[~drawn]


def _same_rows(pairs: NDArray, others: NDArray) -> NDArray[np.bool_]:
    """Whether each pair is among the others."""
    if not len(others):
        return np.zeros(len(pairs), dtype=bool)
    size = int(max(pairs.max(initial=0), others.max())) + 1
    return np.isin(pairs @ [size, 1], others @ [size, 1])


def _sides(
    whole: FaceComplex, wedges: _Wedges, outside: NDArray[np.bool_], turned: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Pairs (corner, half-edge).

    Where nothing else meets at b, a face on the far side of both edges would contain the vanished edge as a diagonal:
    the corner takes up the far sides as well, if they belong to such a face.
    """
    number = np.arange(len(wedges.apex))
    lone = np.bincount(whole.tail, minlength=whole.n_vertices)[wedges.apex] == 2
    lone &= ~outside[wedges.ends[:, 0] ^ 1] & ~turned
    near = np.column_stack([np.repeat(number, 2), wedges.ends.ravel()])
    far = np.column_stack([np.repeat(number[lone], 2), wedges.ends[lone].ravel() ^ 1])
    return np.concatenate([near, far])


def _in_strips(whole: FaceComplex, corners: NDArray) -> NDArray[np.bool_]:
    """Corners of the one reading of paths that hang on a graph, or are one: strips of triangles.

    Every vertex inside such a path has a right angle, on alternating sides. Which side is the left one is told by
    the distance from a root.
    """
    bridge = whole.face == whole.face[np.arange(len(whole.face)) ^ 1]
    two = np.bincount(whole.tail, minlength=whole.n_vertices) == 2
    inside = two[whole.head[corners]] & bridge[corners] & bridge[whole.successor[corners]]
    if not inside.any():
        return inside
    n = whole.n_vertices
    graph = sp.coo_array((np.ones(len(whole.edges)), whole.edges.T), shape=(n, n)).tocsr()
    # One root for each component, or parts without one would have no distance; never inside a path.
    label = csgraph.connected_components(graph, directed=False)[1]
    order = np.argsort(2 * label + two, kind="stable")
    root = order[np.flatnonzero(np.diff(label[order], prepend=-1))]
    depth = csgraph.dijkstra(graph, directed=False, indices=root, unweighted=True, min_only=True).astype(np.int64)
    outwards = depth[whole.tail[corners]] < depth[whole.head[corners]]
    return inside & (outwards == (depth[whole.head[corners]] % 2 == 0))
