"""Oriented boundary loops of a triangulated surface."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from .keys import first_rows
from .orientation import Gluing


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
    n_loops, loop = csgraph.connected_components(step, directed=True, connection="weak")
    start = first_rows(loop, n_loops)
    # Breadth-first from an extra node that points at the first element of each cycle.
    graph = sp.csr_array(
        (np.ones(b + n_loops, np.int8), np.append(successor, start), np.append(np.arange(b + 1), b + n_loops)),
        shape=(b + 1, b + 1),
    )
    reached, _ = csgraph.breadth_first_order(graph, b, directed=True)
    reached = reached[1:]
    order = reached[np.argsort(loop[reached], kind="stable")]
    return loop.astype(np.int64), order.astype(np.int64)
