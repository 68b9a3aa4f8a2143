"""Meshes that the matrix cannot tell apart.

See the page on theory in the documentation: what can be read in two ways hangs together by right-angled cells whose
far sides have vanished from the boundary.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..matrix import OperatorMatrix
from ..topology import Topology
from .corners import Alternative, Corners, OrientedMesh
from .flips import turned_over
from .hinged import as_one_piece
from .hubs import Hub, hubs, rearranged
from .loose import is_loose, other_reading
from .other_scales import other_scales
from .regrouped import fitting, regrouped
from .rereading import other_readings
from .twins import twins

AGREE = 1e-9
"""Relative difference of numbers that count as equal."""


def alternatives(
    stored: OperatorMatrix,
    topology: Topology,
    mesh: OrientedMesh,
    factors: NDArray,
    *,
    scale: float | None,
    agree: float = AGREE,
) -> list[Alternative]:
    """Other meshes that fit as well as the one found: the places where they differ, each by itself.

    Where the rules find none, small graphs are read again in other orders.

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
    """
    found: list[Alternative] = []
    if len(topology.vanished) > (topology.polygons.size - 3).sum():  # not on diagonals only
        found = _by_rules(stored, topology, mesh, factors, scale_known=scale is not None, agree=agree)
    return found or other_readings(stored, mesh, factors, scale)


def _by_rules(
    stored: OperatorMatrix,
    topology: Topology,
    mesh: OrientedMesh,
    factors: NDArray,
    *,
    scale_known: bool,
    agree: float,
) -> list[Alternative]:
    corners = Corners.of(stored.n, stored.edges, mesh)
    around = list(hubs(corners, mesh.z))
    found = twins(stored, mesh, agree)
    orders = [other for hub in around if (other := rearranged(hub, agree)) is not None]
    # Parts that hang together at a hub only may yet be joined by other pieces.
    found += fitting(stored, mesh, factors, orders) if len(topology.hinges) else orders
    found += turned_over(corners, mesh.z, agree)
    if not scale_known:
        found += _loose_pieces(stored, topology, corners, around)
        found += as_one_piece(stored, topology, corners, around)
    found = found or regrouped(stored, mesh, corners, factors, agree)
    if not found and not scale_known:
        found = other_scales(stored, topology, mesh, factors, around)
    return _each_once(found)


def _loose_pieces(stored: OperatorMatrix, topology: Topology, corners: Corners, around: list[Hub]) -> list[Alternative]:
    """Pieces that no other shares a vertex with: what hangs on another has its c."""
    found = []
    for piece in topology.pieces:
        if len(piece.edges) > 2.5 * piece.n_vertices or (topology.multiplicity[piece.vertices] > 1).any():
            continue
        own = np.zeros(stored.n, dtype=bool)
        own[piece.vertices] = True
        its_hubs = [hub for hub in around if own[hub.row]]
        if is_loose(piece.n_vertices, len(piece.edges), its_hubs):
            triangles = piece.vertices[piece.triangles]
            other = other_reading(stored, triangles, corners.chosen(own[corners.apex]), its_hubs)
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
