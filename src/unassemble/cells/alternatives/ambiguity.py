"""Meshes that the matrix cannot tell apart.

See the page on theory in the documentation: what can be read in two ways hangs together by right-angled cells whose
far sides have vanished from the boundary.
"""

from __future__ import annotations

from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from ...matrix import OperatorMatrix
from ...topology import Topology
from ...topology.canonical import LARGEST
from ...topology.keys import Grouped
from .closings import closed_by_right_angles
from .corners import Alternative, Corners, OrientedMesh
from .flips import turned_over
from .hanging import other_hanging_parts
from .hinged import as_one_piece
from .hubs import Hub, closed_at, hubs, rearranged
from .loose import is_loose, other_reading
from .nearby import nearby_readings
from .other_scales import other_scales
from .regrouped import fitting, regrouped
from .rereading import LARGER, MOST_VERTICES, other_readings
from .symmetric import symmetric
from .two_places import two_places

AGREE = 1e-9
"""Relative difference of numbers that count as equal."""


class Untried(Enum):
    """Where other meshes may be that could not be looked for."""

    SCALES = auto()
    """With another factor c, in small pieces."""
    PARTS = auto()
    """In parts that hang on a mesh by single vertices."""


def alternatives(
    stored: OperatorMatrix,
    topology: Topology,
    mesh: OrientedMesh,
    factors: NDArray,
    *,
    scale: float | None,
    agree: float = AGREE,
) -> tuple[list[Alternative], Untried | None]:
    """Other meshes that fit as well as the one found: the places where they differ, each by itself.

    Where the rules find none, loose pieces are read with other factors, and small graphs again in other orders.

    Parameters
    ----------
    stored : OperatorMatrix
        Without the vanished entries.
    topology : Topology
        Of the mesh that was found.
    mesh : OrientedMesh
    factors : (n,) float64
        c of the piece of each row.
    scale : float, optional
        c, where it is known; otherwise a mesh with another c is as good.
    agree : float

    Returns
    -------
    alternatives : list of Alternative
    untried : Untried or None
        Whether there may be others that could not be looked for.
    """
    found: list[Alternative] = []
    corners = Corners.of(stored.n, stored.edges, mesh)
    around = list(hubs(corners, mesh.z, agree))
    closed = closed_at(stored.n, around)
    untried: Untried | None = None
    at_boundary = len(topology.vanished) > (topology.polygons.size - 3).sum()  # not on diagonals only
    renamed = symmetric(stored, mesh, agree) if at_boundary or stored.n <= LARGEST else []
    if at_boundary:
        orders = [other for hub in around if (other := rearranged(hub, agree)) is not None]
        # Parts that hang together at a hub only may yet be joined by other pieces.
        found += fitting(stored, mesh, factors, orders, agree) if len(topology.hinges) else orders
        found += turned_over(corners, mesh.z, agree)
        if scale is None:
            found += _loose_pieces(stored, topology, corners, around, closed)
    found += two_places(stored, mesh, factors, agree)
    found = found or regrouped(stored, mesh, corners, factors, agree)
    if not found and scale is None:
        found, left_open = other_scales(stored, topology, mesh, factors, closed, agree)
        untried = Untried.SCALES if left_open else None
        found = found or as_one_piece(stored, topology, closed, corners.apex)
    found = _each_once(found + renamed) or other_readings(stored, mesh, factors, scale, agree)
    if not found:
        found, left_open = other_hanging_parts(stored, mesh, factors, agree)
        untried = untried or (Untried.PARTS if left_open else None)
    found = found or nearby_readings(stored, mesh, factors, scale, agree)
    if not found and at_boundary:
        found = other_readings(stored, mesh, factors, scale, agree, least=MOST_VERTICES, most=LARGER)
    return found, untried


def touching(
    stored: OperatorMatrix,
    topology: Topology,
    mesh: OrientedMesh,
    factors: NDArray,
    *,
    scale: float | None,
    agree: float,
) -> tuple[list[Alternative], Untried | None]:
    """Other meshes where no vanished entries need be supposed, of pieces that touch in a vertex, and of loose ones.

    Rows may be renamed; single vertices may have two places. Right angles of their cells may be regrouped; and if all
    have the same entries, they may be parts of larger ones.
    Vertices on the boundary of loose pieces may lie inside of a mesh with another c.

    Parameters and results are those of :func:`alternatives`.
    """
    moved = symmetric(stored, mesh, agree) if stored.n <= LARGEST else []
    moved += two_places(stored, mesh, factors, min(agree, AGREE))  # errors do not make entries vanish
    if moved:
        return moved, None
    closed, left_open = closed_by_right_angles(stored, topology, mesh, factors) if scale is None else ([], False)
    untried = Untried.SCALES if left_open else None
    if closed or (np.bincount(mesh.boundary[:, 0], minlength=stored.n) < 2).all():
        return closed, untried
    found = regrouped(stored, mesh, Corners.of(stored.n, stored.edges, mesh), factors, agree)
    if found or scale is not None:
        return found, untried
    none = np.zeros(stored.n, dtype=np.int64)
    found, left_open = other_scales(stored, topology, mesh, factors, none, agree)
    found = found or as_one_piece(stored, topology, none, np.empty(0, np.int64))
    return found, Untried.SCALES if left_open else untried


def _loose_pieces(
    stored: OperatorMatrix, topology: Topology, corners: Corners, around: list[Hub], closed: NDArray[np.int64]
) -> list[Alternative]:
    """Pieces that no other shares a vertex with: what hangs on another has its c."""
    single = [
        piece
        for piece in topology.pieces
        if is_loose(piece, closed) and not (topology.multiplicity[piece.vertices] > 1).any()
    ]
    owner = np.full(stored.n, -1)
    for k, piece in enumerate(single):
        owner[piece.vertices] = k
    corners_of = Grouped(owner[corners.apex], len(single))
    hubs_of: list[list[Hub]] = [[] for _ in single]
    for hub in around:
        if owner[hub.row] >= 0:
            hubs_of[owner[hub.row]].append(hub)
    found = []
    for k, piece in enumerate(single):
        own = corners.chosen(corners_of.order[corners_of.start[k] : corners_of.start[k + 1]])
        other = other_reading(stored, piece.vertices[piece.triangles], own, hubs_of[k])
        found += [other] if other is not None else []
    return found


def _each_once(found: list[Alternative]) -> list[Alternative]:
    seen, kept = set(), []
    for one in found:
        key = (frozenset(one.cells), frozenset(one.other_cells))
        if key not in seen:
            seen.add(key)
            kept.append(one)
    return kept
