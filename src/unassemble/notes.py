"""What is to be said about a mesh beside its status: sentences for ``warnings``."""

from __future__ import annotations

from numpy.typing import NDArray

from .topology import Topology


def topology_notes(topology: Topology) -> list[str]:
    """Pieces, hinges, rows without a position."""
    notes = []
    if len(topology.pieces) > 1:
        notes.append(
            f"{len(topology.pieces)} pieces: the matrix does not say how they lie relative to each other, "
            "so each has a frame of its own"
        )
    if len(topology.hinges):
        notes.append(f"{len(topology.hinges)} vertices join pieces that share nothing else: {_some(topology.hinges)}")
    if len(topology.undetermined):
        notes.append(
            f"{len(topology.undetermined)} rows belong to no triangle and have no position: "
            f"{_some(topology.undetermined)}"
        )
    return notes


def image_notes(topology: Topology, free: NDArray) -> list[str]:
    """Pieces, by number, of which the mirror image fits as well."""
    return [
        f"piece {label}, of row {topology.pieces[label].vertices.min()}: its mirror image meets the other pieces in "
        "the same vertices, and the matrix does not tell which of the two it is"
        for label in free.tolist()
    ]


def vanished_notes(topology: Topology) -> list[str]:
    """Cells that stay undivided, boundary edges without an entry."""
    notes = []
    polygons = topology.polygons
    if polygons.count:
        notes.append(
            f"{polygons.count} cells have more than three vertices, on one circle: entries on their diagonals "
            "vanish whichever way they are divided, so any division into triangles gives the same matrix"
        )
    diagonals = int((polygons.size - 3).sum())
    if len(topology.vanished) > diagonals:
        count = len(topology.vanished) - diagonals
        notes.append(f"{count} boundary edges, which face right angles, have no entry in the matrix")
    return notes


def _some(rows: NDArray, count: int = 8) -> str:
    return ", ".join(map(str, rows[:count])) + (", ..." if len(rows) > count else "")
