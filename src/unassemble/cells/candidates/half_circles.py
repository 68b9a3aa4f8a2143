"""Cells on half circles: their longest side, a diameter, faces right angles only and has vanished from the boundary.

A corner triangle is one with three vertices. Those with four show as paths of three edges along empty faces, and so
on; on irregular points more than six on one circle are rare.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...topology.faces import FaceComplex, joined
from .angles import facing_angles
from .open_corners import OpenCorners
from .outlines import Outlines

_EDGES = (3, 4, 5)  # of a path
_FULL = 0.85 * np.pi  # angle sum below which a path may be one: it should be pi/2, but shares weights with neighbours
_INNER = 0.35 * np.pi  # excess of angles at its inner vertices, which look like vertices inside the mesh


@dataclass(frozen=True, eq=False)
class HalfCircles(Outlines):
    """Paths along empty faces, every two edges of which are an open corner.

    Attributes
    ----------
    turned : (k,) bool
        Not as drawn: with parts of the drawing turned over.
    """

    turned: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        whole: FaceComplex,
        outside: NDArray[np.bool_],
        corners: OpenCorners,
        cotangents: NDArray,
        angles: NDArray,
        excess: NDArray,
        *,
        wide: bool = False,
    ) -> HalfCircles:
        """Find those that may be cells.

        An edge with empty faces on both sides is bare: it borders one cell at most, which faces it with all of its
        weight. A path along none must look like one that the mesh surrounds. Of others no more is asked than that
        their bare edges leave room for the rest: such a cell may hang on the mesh by one edge.

        Parameters
        ----------
        whole : FaceComplex
            A drawing of the graph.
        outside : (2 e,) bool
            Half-edges of empty faces.
        corners : OpenCorners
            Those of the drawing.
        cotangents : (e,) float64
            Weights in units of c.
        angles : (2 e,) float64
            Facing each half-edge, weights being shared equally.
        excess : (n,) float64
            Of these angles about each vertex over 2 pi.
        wide : bool
            Whether parts of the drawing may be turned over, the excess may be twice as much, and paths along bare edges
            need not look surrounded: inner vertices may be on another boundary or be passed twice.
        """
        inner = (-np.inf, 2 * _INNER) if wide else (-_INNER, _INNER)
        bare = outside & outside[np.arange(len(outside)) ^ 1]
        own = np.where(bare, np.repeat(facing_angles(2 * cotangents), 2), 0.0)
        steps = _Paths.of_corners(corners)
        paths = steps = steps if wide else steps.chosen(~steps.turned)
        found = []
        for _ in _EDGES:
            paths = paths.longer(whole, steps)
            about = excess[paths.vertices[:, 1:-1]]
            room = (about < inner[1]).all(axis=1) & (own[paths.half].sum(axis=1) < _FULL)
            surrounded = (about > inner[0]).all(axis=1) & (angles[paths.half].sum(axis=1) < _FULL)
            paths = paths.chosen(room if wide else room & surrounded)
            possible = paths.run_along(whole)
            if wide:
                possible &= surrounded[room] | bare[paths.half].any(axis=1)
            found.append(paths.chosen(possible))
        degree = np.bincount(whole.tail, minlength=whole.n_vertices)
        count = np.cumsum([0, *(len(some.half) for some in found)])
        return cls(
            size=np.concatenate([np.full(len(some.half), some.vertices.shape[1]) for some in found]),
            vertices=np.concatenate([some.vertices.ravel() for some in found]),
            sides=np.concatenate([some.sides(degree, outside) + [k, 0] for some, k in zip(found, count, strict=False)]),
            turned=np.concatenate([some.turned for some in found]),
        )


@dataclass(frozen=True, eq=False)
class _Paths:
    """Half-edges (k, m) and vertices (k, m + 1) of paths, and whether any corner on the way is not as drawn."""

    half: NDArray[np.int64]
    vertices: NDArray[np.int64]
    turned: NDArray[np.bool_]

    @classmethod
    def of_corners(cls, corners: OpenCorners) -> _Paths:
        """Two edges each, in both directions."""
        return cls(
            np.concatenate([corners.ends, corners.ends[:, ::-1]]),
            np.concatenate([corners.vertices, corners.vertices[:, ::-1]]),
            np.tile(corners.turned, 2),
        )

    def longer(self, whole: FaceComplex, two: _Paths) -> _Paths:
        """With one more edge each, by paths of two, in all ways in which they are nowhere else joined to themselves."""
        key = 2 * two.half[:, 0] + (two.vertices[:, 1] == whole.head[two.half[:, 0]])  # the end at which they turn
        order = np.argsort(key, kind="stable")
        wanted = 2 * self.half[:, -1] + (self.vertices[:, -1] == whole.head[self.half[:, -1]])
        first, last = (np.searchsorted(key[order], wanted, side) for side in ("left", "right"))
        path = np.repeat(np.arange(len(wanted)), last - first)
        step = order[np.arange(len(path)) + np.repeat(last - np.cumsum(last - first), last - first)]
        new, before = two.vertices[step, 2], self.vertices[path]
        apart = np.ones(len(path), dtype=bool)
        for vertex in before[:, :-1].T:
            apart &= (new != vertex) & ~joined(whole.n_vertices, whole.edges, new, vertex)
        return _Paths(
            np.column_stack([self.half[path], two.half[step, 1]]),
            np.column_stack([before, new]),
            self.turned[path] | two.turned[step],
        ).chosen(apart)

    def chosen(self, which: NDArray[np.bool_]) -> _Paths:
        """Some of them."""
        return _Paths(self.half[which], self.vertices[which], self.turned[which])

    def run_along(self, whole: FaceComplex) -> NDArray[np.bool_]:
        """Which paths, all of which are found from both ends, go the way of their half-edges, or of most of them."""
        along = 2 * (whole.tail[self.half] == self.vertices[:, :-1]).sum(axis=1) - self.half.shape[1]
        return np.asarray((along > 0) | ((along == 0) & (self.half[:, 0] < self.half[:, -1])))

    def sides(self, degree: NDArray[np.int64], outside: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Pairs (path, half-edge); those beyond two edges as well where nothing else meets, as of corners."""
        near = np.column_stack([np.repeat(np.arange(len(self.half)), self.half.shape[1]), self.half.ravel()])
        lone = degree[self.vertices[:, 1:-1]] == 2
        far = np.zeros(self.half.shape, dtype=bool)
        far[:, 1:] |= lone
        far[:, :-1] |= lone
        far &= ~outside[self.half ^ 1] & ~self.turned[:, None]
        path, place = np.nonzero(far)
        return np.concatenate([near, np.column_stack([path, self.half[path, place] ^ 1])])
