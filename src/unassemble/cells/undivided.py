"""Triangles that share a vanished side are one cell, however a reading came by them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..topology import Piece, Polygons, loops
from ..topology.keys import distinct, found
from ..topology.numbering import connected
from ..topology.surface import Together


def undivided(pieces: Sequence[Piece], vanished: NDArray[np.bool_]) -> tuple[NDArray[np.int64], Polygons]:
    """Cells in the numbering of ``piece.vertices``: triangles, and the outlines of those made of several triangles.

    `vanished` (e,): rows of the edge list that ``piece.edge_rows`` refer to.
    """
    if not pieces:
        return np.empty((0, 3), np.int64), Polygons.none()
    whole = Together(pieces)
    diagonal = vanished[whole.edge_rows] & whole.inner
    owner, corner = np.divmod(np.flatnonzero(diagonal[whole.opposite].ravel()), 3)
    order = np.argsort(whole.opposite[owner, corner], kind="stable")  # both triangles of each diagonal in turn
    one, other = owner[order].reshape(-1, 2).T
    group = connected(len(whole.triangles), one, other)[1]
    joined = (np.bincount(group) > 1)[group]
    triangle, turn = np.nonzero(joined[:, None] & ~diagonal[whole.opposite])
    tail, head = (whole.triangles[triangle, (turn + step) % 3] for step in (1, 2))
    outlines = _cycles(group[triangle], tail, head, whole.vertices)
    if outlines is None:
        return whole.vertices[whole.triangles], Polygons.none()
    return whole.vertices[whole.triangles[~joined]], outlines


def _cycles(group: NDArray, tail: NDArray, head: NDArray, name: NDArray) -> Polygons | None:
    """Polygons of directed sides, all of a group being one; vertex v is called ``name[v]``.

    None if the sides of a group are no single cycle, as may be where cells do not fit.
    """
    order = np.lexsort((tail, group))
    group, tail, head = group[order], tail[order], head[order]
    n = int(tail.max(initial=0)) + 1
    following, there = found(group * n + tail, group * n + head)
    if not there.all() or len(distinct(following)) < len(following):
        return None
    loop, around = loops(following)
    if len(distinct(loop)) > len(distinct(group)):
        return None
    return Polygons(np.append(0, np.cumsum(np.bincount(loop))), name[tail[around]])
