"""From glued triangles to oriented pieces, each in a numbering of its own."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from .keys import Grouped, distinct, first_rows
from .orientation import Gluing, boundary_corners, following, glue, loops, orient
from .surface import Piece


@dataclass(frozen=True, eq=False)
class _Surfaces:
    """Oriented triangles, how they are glued, and the piece of everything."""

    triangles: NDArray[np.int64]
    opposite: NDArray[np.int64]
    facing: NDArray[np.int64]
    boundary: NDArray[np.int64]  # loop by loop
    loop: NDArray[np.int64]  # of each boundary edge
    at: NDArray[np.int64]  # piece n + vertex for all pairs that occur, increasing
    of_triangles: NDArray[np.int64]
    of_edges: NDArray[np.int64]  # -1 for edges of none
    of_boundary: NDArray[np.int64]


def planar_pieces(n: int, edges: NDArray, triangles: NDArray, opposite: NDArray) -> tuple[Piece, ...] | None:
    """Cut triangles into oriented pieces; None where one of them is not a sphere with holes.

    `edges` (e, 2); `triangles` (m, 3): in any orientation; `opposite` (m, 3): rows of `edges` that face the corners.
    """
    if not len(triangles):
        return ()
    gluing = glue(len(edges), opposite)
    if (gluing.count > 2).any():
        return None
    flip, piece, orientable = orient(triangles, gluing)
    if not orientable.all():
        return None
    triangles, opposite = (np.where(flip[:, None], of[:, [0, 2, 1]], of) for of in (triangles, opposite))
    corner = np.arange(triangles.size).reshape(-1, 3)
    corner[flip] = corner[flip][:, [0, 2, 1]]
    moved = np.append(corner.ravel(), -1)  # -1 stays -1
    gluing = Gluing(gluing.count, moved[gluing.first], moved[gluing.second])
    corners = boundary_corners(gluing)
    if not len(corners):
        return None
    loop, order = loops(following(triangles, gluing, corners))
    loop, corners = loop[order], corners[order]
    boundary = np.column_stack([triangles.ravel()[corners - corners % 3 + (corners + turn) % 3] for turn in (1, 2)])
    if piece.any():  # keys of all pairs that occur; of one piece without sorting
        at = distinct(piece[:, None] * n + triangles)
    else:
        at = np.flatnonzero(np.bincount(triangles.ravel(), minlength=n))
    edge_piece = np.where(gluing.count > 0, piece[gluing.first // 3], -1)
    whole = _Surfaces(triangles, opposite, gluing.faces, boundary, loop, at, piece, edge_piece, piece[corners // 3])
    return _cut(n, edges, whole) if _spheres_with_holes(n, whole) else None


def _spheres_with_holes(n: int, whole: _Surfaces) -> bool:
    """Euler's formula for every piece, with a vertex counted once for each fan of triangles about it.

    A vertex with p boundary edges leaving it in a piece has p fans, one if p = 0. A second closed
    fan would be missed here, but counting it could only raise v - e + m, which is at most 2 - loops.
    """
    count = partial(np.bincount, minlength=int(whole.of_triangles.max()) + 1)
    rim = whole.of_boundary
    n_loops = count(rim[first_rows(whole.loop, int(whole.loop.max()) + 1)])
    n_vertices = count(whole.at // n) + count(rim) - count(distinct(rim * n + whole.boundary[:, 0]) // n)
    n_edges = count(whole.of_edges[whole.of_edges >= 0])
    return bool(((n_vertices - n_edges + count(whole.of_triangles) == 2 - n_loops) & (n_loops > 0)).all())


def _cut(n: int, edges: NDArray, whole: _Surfaces) -> tuple[Piece, ...]:
    """Number each piece by itself: everything is sorted by piece, and pieces are slices of that."""
    at, n_pieces = whole.at, int(whole.of_triangles.max()) + 1
    if n_pieces == 1 and len(at) == n and not (whole.of_edges < 0).any():
        offsets = np.append(np.flatnonzero(np.diff(whole.loop, prepend=-1)), len(whole.loop))
        numbered = np.arange(n), np.arange(len(edges)), edges, whole.triangles, whole.opposite
        return (Piece(*numbered, whole.facing, whole.boundary, offsets),)
    labels = at // n, whole.of_edges, whole.of_triangles, whole.of_boundary
    vertex, of_edges, of_triangles, of_boundary = (Grouped(label, n_pieces) for label in labels)
    edge_rows, rows, ring = of_edges.order, of_triangles.order, of_boundary.order

    def local(label: NDArray, vertices: NDArray) -> NDArray[np.int64]:
        """The number of each vertex (k, 2 or 3) in its piece (k,)."""
        return np.searchsorted(at, label[:, None] * n + vertices) - vertex.start[label][:, None]

    facing = whole.facing[edge_rows]
    loop_start = np.flatnonzero(np.diff(whole.loop[ring], prepend=-1))
    of_loops = Grouped(whole.of_boundary[ring[loop_start]], n_pieces)
    # Where the loops of each piece start on its boundary, and where the last one ends.
    start = of_loops.start + np.arange(n_pieces + 1)
    owner = np.repeat(np.arange(n_pieces), np.diff(of_loops.start))
    offsets = np.empty(start[-1], dtype=np.int64)
    offsets[np.arange(len(loop_start)) + owner] = loop_start - of_boundary.start[owner]
    offsets[start[1:] - 1] = np.diff(of_boundary.start)
    parts = (
        (at % n, vertex.start),
        (edge_rows, of_edges.start),
        (local(whole.of_edges[edge_rows], edges[edge_rows]), of_edges.start),
        (local(whole.of_triangles[rows], whole.triangles[rows]), of_triangles.start),
        (of_edges.rank[whole.opposite[rows]], of_triangles.start),
        (np.where(facing < 0, -1, 3 * of_triangles.rank[facing // 3] + facing % 3), of_edges.start),
        (local(whole.of_boundary[ring], whole.boundary[ring]), of_boundary.start),
        (offsets, start),
    )
    cuts = [np.split(value, start[1:-1]) for value, start in parts]
    return tuple(Piece(*arrays) for arrays in zip(*cuts, strict=True))
