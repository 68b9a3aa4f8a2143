"""Triangles glued along edges: their consistent orientation, and the loops of their boundary."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from .numbering import breadth_first


@dataclass(frozen=True, eq=False)
class Gluing:
    """Which corners face each edge."""

    count: NDArray[np.int64]  # (e,) number of triangles at each edge
    # (e,) each: corners (3 * triangle + position) that face the edge, -1 where there is none
    first: NDArray[np.int64]
    second: NDArray[np.int64]

    @property
    def faces(self) -> NDArray[np.int64]:
        """(e, 2) both corners."""
        return np.column_stack([self.first, self.second])


def glue(n_edges: int, opposite: NDArray) -> Gluing:
    """Invert `opposite` (m, 3), the edge that faces each corner."""
    corners = opposite.size
    by_corner = sp.csr_array(
        (np.ones(corners, np.int8), opposite.ravel().astype(np.int32), np.arange(corners + 1, dtype=np.int32)),
        shape=(corners, n_edges),
    )
    by_edge = by_corner.tocsc()
    start = by_edge.indptr[:-1].astype(np.int64)
    count = np.diff(by_edge.indptr).astype(np.int64)
    padded = np.append(by_edge.indices, [-1, -1]).astype(np.int64)
    first = np.where(count > 0, padded[start], -1)
    second = np.where(count > 1, padded[start + 1], -1)
    return Gluing(count, first, second)


def orient(triangles: NDArray, gluing: Gluing) -> tuple[NDArray, NDArray, NDArray]:
    """Turn triangles so that neighbours run along their common edge in opposite directions.

    Returns `flip` (m,): triangles to be reversed; the first triangle of each piece is kept; `piece` (m,): label of the
    edge-connected piece, in order of the pieces' first triangles; `orientable` (number of pieces,).
    """
    m = len(triangles)
    inner = gluing.second >= 0
    one, two = gluing.first[inner], gluing.second[inner]
    clash = _runs_upwards(triangles, one) == _runs_upwards(triangles, two)
    one, two = one // 3, two // 3
    dual = sp.csr_array(
        (np.tile(np.where(clash, 2, 1).astype(np.int8), 2), (np.r_[one, two], np.r_[two, one])), shape=(m, m)
    )
    n_pieces, piece = csgraph.connected_components(dual, directed=False)
    order, parent = breadth_first(dual, piece)
    rows = np.arange(m)
    above = np.where(parent < 0, rows, parent)
    turned = np.asarray(dual[rows, above]).ravel() == 2
    turned[parent < 0] = False
    flip = np.empty(m, dtype=bool)
    flip[order] = _parity_to_root(order, above, turned)
    orientable = np.ones(n_pieces, dtype=bool)
    orientable[piece[one[(flip[one] ^ flip[two]) != clash]]] = False
    return flip, piece.astype(np.int64), orientable


def _runs_upwards(triangles: NDArray, corner: NDArray) -> NDArray:
    """Whether the edge facing a corner runs from the lower to the higher vertex."""
    flat = triangles.ravel()
    base, position = 3 * (corner // 3), corner % 3
    return flat[base + (position + 1) % 3] < flat[base + (position + 2) % 3]


def _parity_to_root(order: NDArray, parent: NDArray, turned: NDArray) -> NDArray[np.bool_]:
    """Number of turned tree edges between each triangle and its root, modulo 2, in breadth-first order.

    By doubling: after k rounds each pointer spans 2^k tree edges. In breadth-first order pointers increase, so
    that memory is read nearly in sequence.
    """
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order), dtype=order.dtype)
    pointer, parity = rank[parent[order]], turned[order]
    while True:
        parity = parity ^ parity[pointer]
        further = pointer[pointer]
        if np.array_equal(further, pointer):
            return parity
        pointer = further


def boundary_corners(gluing: Gluing) -> NDArray:
    """Corners that face a boundary edge, in order of the edges."""
    return gluing.first[gluing.count == 1]


def following(triangles: NDArray, gluing: Gluing, corners: NDArray) -> NDArray:
    """For each boundary edge a -> b the place in `corners` of the boundary edge b -> c of the same fan.

    Rotates about b from triangle to triangle, all edges at once, so that a vertex at which the
    boundary touches itself is passed on the right side.
    """
    m3 = triangles.size
    partner = np.full(m3, -1, dtype=np.int64)
    inner = gluing.second >= 0
    partner[gluing.first[inner]] = gluing.second[inner]
    partner[gluing.second[inner]] = gluing.first[inner]
    place = np.full(m3, -1, dtype=np.int64)
    place[corners] = np.arange(len(corners))
    # The edge facing corner k ends at corner k + 2; the next edge of the triangle faces corner k + 1.
    current = 3 * (corners // 3) + (corners + 1) % 3
    turning = np.arange(len(corners))
    while True:
        across = partner[current[turning]]
        turning = turning[across >= 0]
        if not len(turning):
            return place[current]
        across = across[across >= 0]
        current[turning] = 3 * (across // 3) + (across + 1) % 3


def loops(successor: NDArray) -> tuple[NDArray, NDArray]:
    """Cut the permutation `successor` (b,) into its cycles.

    Returns `loop` (b,): cycle of each element; `order` (b,): elements cycle by cycle, each in the order in which it is
    run through.
    """
    b = len(successor)
    if not b:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    step = sp.csr_array((np.ones(b, np.int8), successor, np.arange(b + 1)), shape=(b, b))
    loop = csgraph.connected_components(step, directed=False)[1]
    reached, _ = breadth_first(step, loop)
    return loop.astype(np.int64), reached[np.argsort(loop[reached], kind="stable")].astype(np.int64)
