"""Factors c of pieces that share vertices: there is one, but each piece by itself has its own, and errors move it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..planar.hinges import groups
from ..planar.piece import PieceMesh
from ..tolerances import ALIKE, MAGNIFIED
from ..topology import Topology
from .noise import Noise


def leaders(topology: Topology) -> NDArray[np.int64]:
    """(pieces,) of those that hang together by vertices the one that tells c best, with the most entries to spare."""
    n = len(topology.pieces)
    if not len(topology.hinges):
        return np.arange(n)
    group = groups(topology)
    spare = np.array([piece.redundancy for piece in topology.pieces])
    order = np.lexsort((-np.arange(n), spare, group))
    return np.asarray(order[np.searchsorted(group[order], group, side="right") - 1])


def discord(
    topology: Topology, meshes: Sequence[PieceMesh], backward_error: float, noise: Noise | None = None
) -> tuple[str, ...]:
    """What is wrong where pieces share vertices but not c, errors of entries allowed for; up to two sentences.

    `meshes`: where the noise is known the others have been fitted with the c of their leaders, if at all;
    `backward_error`: of the entries; `noise`: their errors.
    """
    if not len(topology.hinges):
        return ()
    lead = leaders(topology)
    c = np.array([mesh.scale for mesh in meshes])
    difference = np.abs(c / c[lead] - 1)
    # A null vector that is not polished may be off by more than the entries; noise says itself how much it explains.
    if difference.max() > max(ALIKE, 0.0 if noise else MAGNIFIED * backward_error):
        worst = int(difference.argmax())
        named = " and ".join(
            f"{c[p]:.6g} in piece {p}, of row {topology.pieces[p].vertices.min()}" for p in (int(lead[worst]), worst)
        )
        return (f"pieces that share vertices have different factors c: {named}",)
    if noise and (rough := _unconfirmed(topology, lead)).any():
        row = topology.pieces[int(rough.argmax())].vertices.min()
        return (
            f"the piece of row {row}, which shares vertices with others, has too few entries to tell under {noise}",
        )
    return ()


def _unconfirmed(topology: Topology, lead: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(pieces,) those that may be something else, as far as the entries of each by itself go.

    A piece with entries to spare tells c. One that hangs by a single vertex on pieces of which one does so can only be
    read in itself, and no other way if nothing has vanished and no triangle may be a hole.
    """
    gone = np.zeros(len(topology.edges), dtype=bool)
    gone[topology.vanished] = True
    shared = np.array([np.count_nonzero(topology.multiplicity[piece.vertices] > 1) for piece in topology.pieces])
    otherwise = np.array([gone[piece.edge_rows].any() or piece.enclosed.any() for piece in topology.pieces])
    spare = np.array([piece.redundancy > 0 for piece in topology.pieces])
    return np.asarray((shared > 0) & (~spare[lead] | ((otherwise | (shared > 1)) & ~spare)))
