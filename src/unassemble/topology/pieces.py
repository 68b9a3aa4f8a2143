"""From glued triangles to oriented pieces, each in a numbering of its own."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .keys import Grouped, distinct
from .orientation import Gluing, boundary_corners, following, glue, loops, orient, reglue
from .surface import Piece


@dataclass(frozen=True, eq=False)
class _Surfaces:
    """Oriented triangles with the edges that face their corners, how they are glued, and the piece of each."""

    triangles: NDArray[np.int64]
    opposite: NDArray[np.int64]
    gluing: Gluing
    piece: NDArray[np.int64]


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
    triangles = np.where(flip[:, None], triangles[:, [0, 2, 1]], triangles)
    opposite = np.where(flip[:, None], opposite[:, [0, 2, 1]], opposite)
    gluing = reglue(gluing, flip)
    corners = boundary_corners(gluing)
    loop, order = loops(following(triangles, gluing, corners))
    if piece.any():  # keys of all pairs that occur; of one piece without sorting
        at = distinct(piece[:, None] * n + triangles)
    else:
        at = np.flatnonzero(np.bincount(triangles.ravel(), minlength=n))
    glued = _Surfaces(triangles, opposite, gluing, piece)
    if not _spheres_with_holes(n, glued, at, corners, loop):
        return None
    return _cut(n, edges, glued, at, corners[order], loop[order])


def _spheres_with_holes(n: int, glued: _Surfaces, at: NDArray, corners: NDArray, loop: NDArray) -> bool:
    """Euler's formula for every piece, with a vertex counted once for each fan of triangles about it.

    A vertex with p boundary edges leaving it in a piece has p fans, one if p = 0. A second closed
    fan would be missed here, but counting it could only raise v - e + m, which is at most 2 - loops.
    """
    triangles, gluing, piece = glued.triangles, glued.gluing, glued.piece
    n_pieces = int(piece.max()) + 1
    n_loops = np.zeros(n_pieces, dtype=np.int64)
    n_edges = np.bincount(piece[gluing.first[gluing.count > 0] // 3], minlength=n_pieces)
    n_triangles = np.bincount(piece, minlength=n_pieces)
    n_vertices = np.bincount(at // n, minlength=n_pieces)
    if len(corners):
        _, one_of_each = np.unique(loop, return_index=True)
        n_loops = np.bincount(piece[corners[one_of_each] // 3], minlength=n_pieces)
        tails = triangles.ravel()[3 * (corners // 3) + (corners + 1) % 3]
        fans = piece[corners // 3] * n + tails
        n_vertices = n_vertices + np.bincount(fans // n, minlength=n_pieces)
        n_vertices -= np.bincount(distinct(fans) // n, minlength=n_pieces)
    return bool(((n_vertices - n_edges + n_triangles == 2 - n_loops) & (n_loops > 0)).all())


def _cut(n: int, edges: NDArray, glued: _Surfaces, at: NDArray, corners: NDArray, loop: NDArray) -> tuple[Piece, ...]:
    """Number each piece by itself: everything is sorted by piece, and pieces are slices of that."""
    triangles, opposite, gluing, piece = glued.triangles, glued.opposite, glued.gluing, glued.piece
    base = 3 * (corners // 3)
    flat = triangles.ravel()
    boundary = np.column_stack([flat[base + (corners + 1) % 3], flat[base + (corners + 2) % 3]])
    n_pieces = int(piece.max()) + 1
    edge_piece = np.where(gluing.count > 0, piece[gluing.first // 3], -1)
    if n_pieces == 1 and len(at) == n and not (edge_piece < 0).any():
        offsets = np.append(np.flatnonzero(np.diff(loop, prepend=-1)), len(loop))
        return (
            Piece(np.arange(n), np.arange(len(edges)), edges, triangles, opposite, gluing.faces, boundary, offsets),
        )
    vertex = Grouped(at // n, n_pieces)
    of_edges = Grouped(edge_piece, n_pieces)
    of_triangles = Grouped(piece, n_pieces)
    of_boundary = Grouped(piece[corners // 3], n_pieces)

    def local(label: NDArray, vertices: NDArray) -> NDArray[np.int64]:
        """The number of each vertex (k, 2 or 3) in its piece (k,)."""
        return np.searchsorted(at, label[:, None] * n + vertices) - vertex.start[label][:, None]

    edge_rows, rows, ring = of_edges.order, of_triangles.order, of_boundary.order
    facing = gluing.faces[edge_rows]
    loop_start = np.flatnonzero(np.diff(loop[ring], prepend=-1))
    of_loops = Grouped(piece[corners // 3][ring[loop_start]], n_pieces)
    # Where the loops of each piece start on its boundary, and where the last one ends.
    start = of_loops.start + np.arange(n_pieces + 1)
    owner = np.repeat(np.arange(n_pieces), np.diff(of_loops.start))
    offsets = np.empty(start[-1], dtype=np.int64)
    offsets[np.arange(len(loop_start)) + owner] = loop_start - of_boundary.start[owner]
    offsets[start[1:] - 1] = np.diff(of_boundary.start)
    parts = (
        (at % n, vertex.start),
        (edge_rows, of_edges.start),
        (local(edge_piece[edge_rows], edges[edge_rows]), of_edges.start),
        (local(piece[rows], triangles[rows]), of_triangles.start),
        (of_edges.rank[opposite[rows]], of_triangles.start),
        (np.where(facing < 0, -1, 3 * of_triangles.rank[facing // 3] + facing % 3), of_edges.start),
        (local(piece[corners // 3][ring], boundary[ring]), of_boundary.start),
        (offsets, start),
    )
    values = [value for value, _ in parts]
    cuts = [start.tolist() for _, start in parts]
    return tuple(
        Piece(*(value[cut[k] : cut[k + 1]] for value, cut in zip(values, cuts, strict=True))) for k in range(n_pieces)
    )
