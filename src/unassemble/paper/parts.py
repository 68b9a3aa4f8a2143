"""A part of a piece, cut out along edges: the tube, or what is inside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece
from ..topology.orientation import boundary_corners, following, glue, loops
from .corners import following_corner


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Some triangles of a piece as a mesh of its own.

    Attributes
    ----------
    piece : Piece
        `vertices` and `edge_rows` refer to the whole piece's own numbering.
    triangles : (k,) int64
        Triangles of the whole.
    corners : (3k,) int64
        Corners of the whole.
    """

    piece: Piece
    triangles: NDArray[np.int64]
    corners: NDArray[np.int64]


def part(whole: Piece, mask: NDArray) -> MeshPart:
    """The triangles in `mask` (m,), oriented as in the whole. They need not hang together."""
    of = np.flatnonzero(mask)
    vertices, local = np.unique(whole.triangles[of], return_inverse=True)
    rows, opposite = np.unique(whole.opposite[of], return_inverse=True)
    triangles, opposite = local.reshape(-1, 3), opposite.reshape(-1, 3)
    gluing = glue(len(rows), opposite)
    rim = boundary_corners(gluing)
    loop, order = loops(following(triangles, gluing, rim))
    flat = triangles.ravel()
    boundary = np.column_stack([flat[following_corner(1, rim)], flat[following_corner(2, rim)]])[order]
    offsets = np.append(np.flatnonzero(np.diff(loop[order], prepend=-1)), len(loop))
    piece = Piece(
        vertices=vertices,
        edge_rows=rows,
        edges=np.searchsorted(vertices, whole.edges[rows]),
        triangles=triangles,
        opposite=opposite,
        facing=gluing.faces,
        boundary=boundary,
        loop_offsets=offsets,
    )
    return MeshPart(piece, of, (3 * of[:, None] + np.arange(3)).ravel())
